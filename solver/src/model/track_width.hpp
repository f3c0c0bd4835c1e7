// The track width as a number of a model: wheels stand closer together or wider apart than they were drawn.
//
// Every wheel's offset from the mid-line is scaled, along the axle of the first wheel. What moves is the top joint of the wheel (a vertical
// steering hinge above it, else the wheel's own) with everything that it carries.
#pragma once

#include "model/rover.hpp"

namespace rille {

// [m] distance of the outermost wheel centres across; 0 where there are not two of them, or the world holds one.
double drawn_track_width(const Rover& rover);

// Moves the wheels to rover.track_width; leaves every bit as it is where they stand so already.
void spread_wheels(Rover& rover);

}  // namespace rille
