// Putting a joint, or the whole mechanism, elsewhere: what a change of state means.
#pragma once

#include "model/model.hpp"
#include "world/mechanism.hpp"

namespace rille {

// Raises InputRefused for a quantity that cannot be put elsewhere, a target that the model does not have, or values that no state has.
void require_change(const Rover& rover, bool held_by_world, const StateChange& change);

// The joint takes its partners in differentials and gears along; the root takes everything along. Needs kinematics that are up to date.
void put_elsewhere(Mechanism& mechanism, const Rover& rover, const StateChange& change);

}  // namespace rille
