// A quantity of a wheel as the soil under it has met it: its mean over the last contact length.
//   d mean/d path = (now - mean)/L,  path: of rim or centre, whichever is longer,  L = sqrt(2 r z): length of the contact
// Laws of steady rolling (slip, speed -> stress) describe soil that was passed under a whole contact. A standing wheel passes none: what it
// meets stays, and the tremble of its speed, of which the ratio is noise, does not change the soil that carries it.
#pragma once

#include <algorithm>
#include <cmath>

#include "effects/effect.hpp"

namespace rille {

class PathMean {
 public:
  void advance(double now, const WheelSite& site, double h) {
    const double radius = site.wheel->radius;
    const double length = std::max(std::sqrt(2 * radius * std::max(site.sinkage, 0.0)), 0.05 * radius);
    const double path = h * std::max(std::abs(site.rim_speed), std::abs(site.travel_speed));
    mean_ -= std::expm1(-path / length) * (now - mean_);
  }
  void set(double now) { mean_ = now; }
  double operator()() const { return mean_; }
  void visit(Archive& archive) { archive(mean_); }

 private:
  double mean_ = 0;
};

}  // namespace rille
