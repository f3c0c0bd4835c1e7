// One run in memory: model in, states and events out. Knows neither files nor databases.
#pragma once

#include <memory>
#include <vector>

#include "model/model.hpp"
#include "model/result.hpp"
#include "simulate/wheel_contact.hpp"
#include "world/mechanism.hpp"

namespace rille {

class Simulation {
 public:
  // Places the mechanism as the scenario says; raises InputRefused if the model cannot be simulated.
  explicit Simulation(Model model);

  // Lets the mechanism come to rest with its drives held, for at most scenario.settle_time; then time starts at zero.
  Outcome settle();
  // One time step. Returns running, or the outcome that ended the run; a finished simulation does not step on.
  Outcome step();

  double time() const { return static_cast<double>(steps_) * model_->scenario.step; }
  long long steps() const { return steps_; }
  Outcome outcome() const { return outcome_; }
  const std::string& message() const { return message_; }
  Snapshot snapshot() const;
  std::vector<Event> take_events();

  const Model& model() const { return *model_; }
  Mechanism& mechanism() { return mechanism_; }
  double largest_differential_error() const;  // [rad] of the constraint theta_a + theta_b = 2 theta_carrier

 private:
  struct DriveState {
    double set_value = 0;  // [rad/s, rad or N m]
    int row = -1;          // row in this step, -1 = none
    RowSide side = RowSide::free;
    double saturated_for = 0;  // [s] at its largest effort
    double effort = 0;     // [N m or N] of the last step
    double work = 0;       // [J] since t = 0
  };
  struct LimitState {
    int joint = -1;
    int row = -1;
    bool at_upper = false;
    RowSide side = RowSide::free;
    bool touching = false;
  };

  void place();
  void read_commands();
  bool open_drive_rows(double h);
  bool open_limit_rows(double h);
  void open_coupling_rows(double h);
  Outcome advance(bool hold);
  Outcome fail(Outcome outcome, std::string message);
  void note(const char* kind, const std::string& subject, std::string message);
  void watch_outlines();
  void account(double h, const Eigen::VectorXd& before, const Eigen::VectorXd& after);

  std::unique_ptr<Model> model_;  // on the heap: contacts point into it
  Mechanism mechanism_;
  std::vector<WheelContact> contacts_;
  std::vector<DriveState> drives_;
  std::vector<LimitState> limits_;
  std::vector<bool> in_ground_;        // by outline
  std::vector<double> position_sign_;  // of each differential: +1 parallel axes, -1 opposed ones
  RowSet rows_;
  RowSolver solver_;
  Eigen::VectorXd effort_;    // (n) efforts that act as given forces in this step
  Eigen::VectorXd velocity_;  // (n) of the next step
  std::size_t next_command_ = 0;
  long long steps_ = 0;
  bool holding_ = false;
  Outcome outcome_ = Outcome::running;
  std::string message_;
  std::vector<Event> events_;
};

}  // namespace rille
