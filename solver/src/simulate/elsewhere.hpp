// Putting joints, or the whole mechanism, elsewhere: what a start and a change of state mean.
//
// A joint takes along what differentials and gears tie to it, through chains of them; the joints of a loop that were not named move, by the
// least change, until it closes. The root takes everything along.
#pragma once

#include "model/model.hpp"
#include "world/mechanism.hpp"

namespace rille {

// Raises InputRefused for a quantity that cannot be put elsewhere, a target that the model does not have, or values that no state has.
void require_change(const Rover& rover, bool held_by_world, const StateChange& change);

// Raises InputRefused as require_change, and where a loop would stay open.
void put_elsewhere(Mechanism& mechanism, const Rover& rover, const StateChange& change);

// The two points [m] in W that a loop closure holds together, at kinematics that are up to date.
struct LoopEnds {
  Eigen::Vector3d a, b;
};
LoopEnds ends_of(const Mechanism& mechanism, const LoopClosure& closure);

// Joints where the scenario starts them. Raises InputRefused where joints that are named contradict a coupling or leave a loop open.
void start_joints(Mechanism& mechanism, const Rover& rover, const Scenario& scenario);

}  // namespace rille
