// Where a rover stands on the ground before it settles.
#pragma once

#include "model/model.hpp"
#include "world/mechanism.hpp"

namespace rille {

// Pose of the root over the terrain at the scenario's x, y and heading: tilted with the plane through the ground under the
// wheels, as low as possible with no wheel below the ground. Raises InputRefused off the map or without wheels.
BodyState pose_on_terrain(const Model& model, Mechanism& mechanism);

}  // namespace rille
