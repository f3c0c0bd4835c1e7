// Skid scrub: a wheel that is turned about the ground's normal (skid steering, steering on the spot) drags its footprint around:
//   M = friction x load x d,  d: mean distance of a rectangle's points (contact length x width) from its centre
// Source: Coulomb friction under uniform pressure; d = sqrt(A^2+B^2)/3 + A^2/(6B) asinh(B/A) + B^2/(6A) asinh(A/B), half sides A, B.
#include <algorithm>
#include <cmath>

#include "effects/effect.hpp"

namespace rille::effects {
// [m] mean distance of the points of a rectangle from its centre
double mean_distance(double length, double width) {
  const double a = 0.5 * length, b = 0.5 * width;
  return std::hypot(a, b) / 3 + a * a / (6 * b) * std::asinh(b / a) + b * b / (6 * a) * std::asinh(a / b);
}

namespace {

class SkidScrub final : public WheelEffect {
 public:
  explicit SkidScrub(double friction) : friction_(friction) {}
  bool acts_on_rigid() const override { return true; }
  void after(const WheelSite& site, SoilReaction& reaction) const override {
    if (reaction.contact_length > 0)
      reaction.scrub_torque += friction_ * std::max(reaction.normal_load, 0.0) * mean_distance(reaction.contact_length, site.wheel->width);
  }

 private:
  double friction_;  // [-]
};

}  // namespace

void attach_skid_scrub(const Attachment& a) { a.to_wheels<SkidScrub>(a["friction"]); }

}  // namespace rille::effects
