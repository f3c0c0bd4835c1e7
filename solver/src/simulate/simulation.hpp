// One run in memory: model in, states and events out. Knows neither files nor databases.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "effects/effect.hpp"
#include "model/model.hpp"
#include "model/result.hpp"
#include "simulate/drive_unit.hpp"
#include "simulate/rigid_contact.hpp"
#include "simulate/sensors.hpp"
#include "simulate/watcher.hpp"
#include "simulate/wheel_contact.hpp"
#include "world/mechanism.hpp"
#include "world/ruts.hpp"

namespace rille {

class Simulation {
 public:
  // Attaches the effects and places the mechanism as the scenario says; raises InputRefused if the model cannot be simulated.
  explicit Simulation(Model model);

  // Lets the mechanism come to rest with its drives held, for at most scenario.settle_time; then time starts at zero.
  // keep_going: asked between steps; false ends early, as `interrupted`.
  Outcome settle(const std::function<bool()>& keep_going = nullptr);
  // One time step. report: also compute the reactions in the joints, which a snapshot shows. Returns running, or the outcome that ended
  // the run; a finished simulation does not step on.
  Outcome step(bool report = true);

  double time() const { return static_cast<double>(steps_) * model_->scenario.step; }
  long long steps() const { return steps_; }
  Outcome outcome() const { return outcome_; }
  const std::string& message() const { return message_; }
  Snapshot snapshot() const;
  std::vector<Event> take_events();
  const std::vector<Event>& events() const { return events_; }  // since they were taken
  std::vector<double> sensor_clocks() const { return sensors_->clocks(time()); }  // [s], of each sensor, now
  std::vector<SensorSample> take_samples() { return sensors_->take_samples(); }
  const WheelState& wheel_state(std::size_t wheel) const { return contacts_[wheel].state(); }
  const Ruts* ruts() const { return ruts_.get(); }

  // The complete state as bytes; a simulation of the same model that is given them goes on bit by bit as this one would.
  std::string save();
  // Raises InputRefused for bytes of another model, or damaged ones; the state is then neither.
  void restore(const std::string& bytes);
  // The same, but a refusal leaves the state as it was, for the price of a save.
  void restore_or_stay(const std::string& bytes);

  // Motion alone: what a smoother knows. A simulation that is put there starts afresh in everything else: commands up to that time are
  // given, integrals and transmissions are at rest, effects begin.
  MechanismState motion() { return mechanism_.state(); }
  void start_at(double time, const MechanismState& motion);
  // Goes on from another motion at the present time; what is not motion stays as it is, and moves along with what carries it.
  void put(const MechanismState& motion);
  // A set value from the next step on, and part of the motion put elsewhere now: what was steered. Both are kept in the scenario, so that a
  // run of it repeats this one bit by bit, and returned as they are kept there: a command with the time when it was given, whatever delays
  // it. Raise InputRefused for what cannot be.
  std::optional<Command> command(int drive, double value);  // none: the drive is set to that already
  StateChange change(StateChange change);
  std::vector<double> set_values() const;  // of the drives [rad/s, rad or N m], as of the next step
  // What is steered from now on comes after this instant, whose state was kept.
  void close_instant() { first_free_step_ = steps_ + 1; }
  // The quantity of the vocabulary as of now; see quantity.hpp.
  std::vector<double> read(Quantity& quantity) const;
  // One component of each of several quantities as of now, into `values` unless that is null.
  void read(std::vector<std::pair<Quantity, int>>& quantities, double* values) const;

  // Effort at every hinge and prismatic joint (n, first six: force on the root) that would give the accelerations (n) in the present
  // state, with the forces of soil and contacts of the last step.
  Eigen::VectorXd inverse_dynamics(const Eigen::VectorXd& acceleration);

  const Model& model() const { return *model_; }
  Mechanism& mechanism() { return mechanism_; }
  double largest_differential_error() const;  // [rad] of the constraint theta_a + theta_b = 2 theta_carrier
  double largest_closure_error() const;       // [m] between the points that a loop_closure holds together

 private:
  struct LimitState {
    int joint = -1;
    int row = -1;
    bool at_upper = false;
    RowSide side = RowSide::free;
    bool touching = false;

    template <class A>
    void visit(A& archive) {
      archive(side, touching);
    }
  };
  struct Work {  // [J] by kind of row, since t = 0
    std::array<double, 6> of_kind = {};
    double given = 0;  // efforts of torque drives and effects

    template <class A>
    void visit(A& archive) {
      archive(of_kind, given);
    }
  };

  static Model& prepared(Model& model, Effects& effects);
  void visit(Archive& archive);
  void load(const std::string& bytes);
  void check_couplings();
  void place();
  // Sets the drives for a step of h [s]: those commanded on the way follow the mean of their command. h = 0: as they are commanded now.
  void read_commands(double h);
  void make_changes();  // those that are due at the beginning of the step
  bool open_drive_rows(double h);  // whether a servo has rows
  void open_joint_effects(double h);
  bool open_limit_rows(double h);
  void open_coupling_rows(double h);
  void open_closure_rows(double h);
  void open_body_effects(double h);
  BodyMotion motion_of(std::size_t body) const;
  Outcome advance(bool hold, bool report);
  bool solve_rows(const Eigen::VectorXd& v_free);
  bool sticks() const;  // whether dry friction holds a joint in the last solution
  bool split_step(double h);
  bool semi_implicit_step(double h);
  // Settling comes before t = 0: events carry 0 and say how far it was, and effects see that no time of theirs has come.
  double event_time() const { return holding_ ? 0 : time(); }
  double time_of_effects() const { return holding_ ? -model_->scenario.step : time(); }
  std::string when() const;
  Outcome fail(Outcome outcome, std::string message);
  void note(const char* kind, const std::string& subject, std::string message);
  double energy();  // [J] kinetic and potential, of the motion as it is
  void start_accounts();
  void account(double h, const Eigen::VectorXd& before, const Eigen::VectorXd& after);
  void look(double h);
  std::vector<JointState> joint_states() const;
  std::vector<WheelState> wheel_states() const;
  // Calls use(Readable) with the states as of now.
  template <class Use>
  auto with_readable(Use&& use) const {
    mechanism_.update_kinematics();
    const std::vector<JointState> joints = joint_states();
    const std::vector<WheelState> wheels = wheel_states();
    return use(Readable{model_.get(), &mechanism_, &joints, &wheels, model_->scenario.step});
  }

  std::unique_ptr<Model> model_;  // on the heap: contacts point into it
  std::unique_ptr<Effects> effects_;
  Mechanism mechanism_;
  std::vector<WheelContact> contacts_;
  std::unique_ptr<RigidContacts> rigid_;
  std::unique_ptr<Ruts> ruts_;
  std::unique_ptr<Sensors> sensors_;
  std::unique_ptr<Watcher> watcher_;
  std::vector<DriveUnit> drives_;
  std::vector<int> drive_of_joint_;
  std::vector<LimitState> limits_;
  RowSet rows_;
  RowSolver solver_;
  Eigen::VectorXd effort_;    // (n) efforts that act as given forces in this step
  Eigen::VectorXd force_;     // (n) with the forces of rows
  Eigen::VectorXd velocity_;  // (n) of the next step
  std::vector<JointReaction> reactions_;
  std::vector<BodyForce> forces_;
  Work work_;
  double energy_at_start_ = 0;     // [J]
  double potential_at_start_ = 0;  // [J]
  std::size_t next_command_ = 0;
  std::size_t next_change_ = 0;
  long long first_free_step_ = 0;  // at which something may still be steered
  long long steps_ = 0;
  bool holding_ = false;
  bool watching_ = false;  // whether sensors or watches must look after every step
  Outcome outcome_ = Outcome::running;
  std::string message_;
  std::vector<Event> events_;
};

}  // namespace rille
