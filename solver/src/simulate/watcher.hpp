// What a person would notice: a rover that tips over or is stuck, a wheel that spins, and the watches that a scenario sets.
#pragma once

#include <vector>

#include "model/archive.hpp"
#include "model/model.hpp"
#include "model/result.hpp"
#include "simulate/quantity.hpp"

namespace rille {

class Watcher {
 public:
  explicit Watcher(const Model& model);

  // Looks at the end of a step; appends events, and returns the watches that act now.
  std::vector<const Watch*> look(double time, double h, const Readable& from, std::vector<Event>& events);
  bool empty() const { return watches_.empty(); }
  void visit(Archive& archive) {
    archive(tipped_, spinning_for_, window_start_, window_rim_path_, window_open_, seen_events_);
    for (Eigen::Vector3d& place : window_from_) archive(place);
    for (State& state : watches_) {
      archive(state.held_for, state.fired);
      for (Quantity& quantity : state.quantity) archive(quantity);
    }
  }
  // Events before this one were looked at already; the caller has taken them away.
  void forget_events() { seen_events_ = 0; }

 private:
  struct State {
    const Watch* watch;
    std::vector<Quantity> quantity;  // empty for watches of events
    double held_for = 0;
    bool fired = false;
  };

  void notice(double time, double h, const Readable& from, std::vector<Event>& events);

  const Model* model_;
  int root_ = -1;
  std::vector<State> watches_;
  bool tipped_ = false;
  std::vector<double> spinning_for_;  // [s] by wheel
  double window_start_ = 0;           // [s] of the look for being stuck
  double window_rim_path_ = 0;        // [m] mean over the wheels
  std::vector<Eigen::Vector3d> window_from_;  // [m] centre of each wheel at its beginning
  bool window_open_ = false;
  std::uint64_t seen_events_ = 0;
};

}  // namespace rille
