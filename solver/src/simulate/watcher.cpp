#include "simulate/watcher.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <iterator>

#include "model/error.hpp"

namespace rille {
namespace {

constexpr double kTipAngle = M_PI / 3;    // [rad] of the root's z axis against the vertical
constexpr double kSpinSlip = 0.9;         // [-] beyond this a wheel digs rather than drives
constexpr double kSpinTime = 0.5;         // [s]
constexpr double kStuckWindow = 5;        // [s]
constexpr double kStuckShare = 0.1;       // [-] of the path of the rims
constexpr double kTurning = 1e-3;         // [m/s] of a rim

constexpr const char* kEvents[] = {"contact_begin", "contact_end", "drive_saturated", "limit_reached", "stuck", "tip_over", "watch", "wheel_spinning"};

// A misspelt event or target would wait for ever.
void require_event(const Watch& watch, const Scenario& scenario, const Rover& rover) {
  if (std::find(std::begin(kEvents), std::end(kEvents), watch.event) == std::end(kEvents))
    throw InputRefused(fmt::format("watch '{}' waits for the event '{}', which never happens; known: {}", watch.name, watch.event, fmt::join(kEvents, ", ")));
  if (watch.target.empty()) return;
  const auto has = [&](const auto& items) { return std::any_of(items.begin(), items.end(), [&](const auto& item) { return item.name == watch.target; }); };
  if (!has(rover.bodies) && !has(rover.joints) && !has(rover.wheels) && !has(rover.drives) && !has(scenario.watches))
    throw InputRefused(fmt::format("watch '{}' waits for '{}' of '{}', but the model has no body, joint, wheel or drive of this name", watch.name,
                                   watch.event, watch.target));
}

}  // namespace

Watcher::Watcher(const Model& model) : model_(&model), spinning_for_(model.rover.wheels.size(), 0.0), window_from_(model.rover.wheels.size(), Eigen::Vector3d::Zero()) {
  std::vector<bool> carried(model.rover.bodies.size(), false);
  for (const Joint& joint : model.rover.joints) carried[static_cast<std::size_t>(joint.child)] = true;
  for (std::size_t b = 0; b < carried.size(); ++b)
    if (!carried[b]) root_ = static_cast<int>(b);
  for (const Watch& watch : model.scenario.watches) {
    State state{&watch, {}};
    if (!watch.event.empty()) {
      require_event(watch, model.scenario, model.rover);
    } else {
      state.quantity.emplace_back(model.rover, watch.quantity, watch.target, false, "watch '" + watch.name + "'");
      if (watch.component < 0 || watch.component >= state.quantity[0].size())
        throw InputRefused(fmt::format("watch '{}' compares component {} of {}, which has {}; count from 0", watch.name, watch.component,
                                       watch.quantity, state.quantity[0].size()));
    }
    watches_.push_back(std::move(state));
  }
}

void Watcher::notice(double time, double h, const Readable& from, std::vector<Event>& events) {
  const Rover& rover = model_->rover;
  if (root_ >= 0 && model_->scenario.gravity.norm() > 0) {
    const Eigen::Vector3d up = from.mechanism->rotate_to_world(root_, Eigen::Vector3d::UnitZ());
    const double tilt = std::acos(std::clamp(-up.dot(model_->scenario.gravity.normalized()), -1.0, 1.0));
    if (!tipped_ && tilt > kTipAngle)
      events.push_back({time, "tip_over", rover.bodies[static_cast<std::size_t>(root_)].name,
                        fmt::format("'{}' leans {:.0f} deg from the vertical at t = {:.3f} s", rover.bodies[static_cast<std::size_t>(root_)].name,
                                    tilt * 180 / M_PI, time)});
    tipped_ = tilt > kTipAngle || (tipped_ && tilt > 0.8 * kTipAngle);
  }
  double rim = 0;
  for (std::size_t w = 0; w < from.wheels->size(); ++w) {
    const Wheel& wheel = rover.wheels[w];
    const double speed = std::abs(wheel.radius * (*from.joints)[static_cast<std::size_t>(wheel.joint)].velocity);
    rim += speed / static_cast<double>(from.wheels->size());
    const WheelState& state = (*from.wheels)[w];
    const bool spins = state.slip_ratio > kSpinSlip && state.normal_load > 0 && speed > kTurning;
    const double before = spinning_for_[w];
    spinning_for_[w] = spins ? before + h : 0;
    if (before < kSpinTime && spinning_for_[w] >= kSpinTime)
      events.push_back({time, "wheel_spinning", wheel.name,
                        fmt::format("wheel '{}' spun with slip above {:g} for {:g} s until t = {:.3f} s", wheel.name, kSpinSlip, kSpinTime, time)});
  }
  if (root_ < 0 || from.wheels->empty()) return;
  if (!window_open_) {
    window_open_ = true;
    window_start_ = time;
    window_rim_path_ = 0;
    for (std::size_t w = 0; w < from.wheels->size(); ++w) window_from_[w] = (*from.wheels)[w].center;
  }
  window_rim_path_ += h * rim;
  if (time - window_start_ < kStuckWindow) return;
  double moved = 0;  // of the wheel that moved most: a rover that turns on the spot is not stuck
  for (std::size_t w = 0; w < from.wheels->size(); ++w) moved = std::max(moved, ((*from.wheels)[w].center - window_from_[w]).norm());
  if (window_rim_path_ > kStuckWindow * kTurning && moved < kStuckShare * window_rim_path_)
    events.push_back({time, "stuck", rover.bodies[static_cast<std::size_t>(root_)].name,
                      fmt::format("the rims of '{3}' ran {0:.3f} m between t = {1:.2f} s and {2:.2f} s, but no wheel moved more than {4:.3f} m", window_rim_path_,
                                  window_start_, time, rover.bodies[static_cast<std::size_t>(root_)].name, moved)});
  window_open_ = false;
}

std::vector<const Watch*> Watcher::look(double time, double h, const Readable& from, std::vector<Event>& events) {
  notice(time, h, from, events);
  std::vector<const Watch*> acting;
  if (watches_.empty()) return acting;
  const std::size_t first = std::min<std::size_t>(seen_events_, events.size());
  const std::size_t last = events.size();
  for (State& state : watches_) {
    if (state.fired) continue;
    const Watch& watch = *state.watch;
    bool now = false;
    std::string reason;
    if (!watch.event.empty()) {
      for (std::size_t k = first; k < last && !now; ++k) {
        now = events[k].kind == watch.event && (watch.target.empty() || watch.target == events[k].subject);
        if (now) reason = events[k].message;
      }
    } else {
      const double value = state.quantity[0].read(from)[static_cast<std::size_t>(watch.component)];
      const bool meets = (!watch.above || value > *watch.above) && (!watch.below || value < *watch.below);
      state.held_for = meets ? state.held_for + h : 0;
      now = meets && state.held_for >= watch.hold;
      reason = fmt::format("{} of '{}' is {:.6g} at t = {:.3f} s", watch.quantity, watch.target, value, time);
    }
    if (!now) continue;
    state.fired = true;
    events.push_back({time, "watch", watch.name, fmt::format("watch '{}': {}", watch.name, reason)});
    acting.push_back(&watch);
  }
  seen_events_ = events.size();
  return acting;
}

}  // namespace rille
