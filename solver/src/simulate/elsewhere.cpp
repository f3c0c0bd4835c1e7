#include "simulate/elsewhere.hpp"

#include <fmt/format.h>

#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <vector>

#include "model/error.hpp"
#include "model/named.hpp"

namespace rille {
namespace {

using Eigen::Quaterniond;
using Eigen::Vector3d;

constexpr double kLongest = 1e6;     // [m, rad or per second] no state is beyond
constexpr double kAgree = 1e-3;      // [rad, m or per second] by which joints that are both named may contradict their coupling
constexpr double kClosed = 1e-9;     // [m or m/s] a loop that is open by no more is closed
constexpr double kOpen = 1e-3;       // [m] one that is open by more is refused: rows would tear it shut
constexpr double kSameRow = 1e-9;    // [-] of the largest: pivots below are rows that repeat others, as those of flat loops do
constexpr double kLargestTurn = 0.3; // [rad or m] in a round, so that a loop stays on its side of a stretched position
constexpr int kMostClosingRounds = 50;

bool of_joint(const StateChange& change) { return change.quantity.starts_with("joint."); }

std::size_t numbers_of(const std::string& quantity) {
  if (quantity == "joint.position" || quantity == "joint.velocity") return 1;
  if (quantity == "part.orientation") return 4;
  if (quantity == "part.position" || quantity == "part.linear_velocity" || quantity == "part.angular_velocity") return 3;
  return 0;
}

int root_of(const Rover& rover) {
  std::vector<bool> carried(rover.bodies.size(), false);
  for (const Joint& joint : rover.joints) carried[static_cast<std::size_t>(joint.child)] = true;
  return static_cast<int>(std::find(carried.begin(), carried.end(), false) - carried.begin());
}

struct Tied {
  int joint;
  double factor;  // its position is that of the first joint times this
};

// The joint itself, and what differentials and gears tie to it.
std::vector<Tied> tied_to(const Rover& rover, int joint) {
  std::vector<Tied> found = {{joint, 1.0}};
  for (std::size_t k = 0; k < found.size(); ++k) {
    const auto [from, factor] = found[k];
    const auto reach = [&](int other, double ratio) {
      if (std::none_of(found.begin(), found.end(), [&](const Tied& tied) { return tied.joint == other; })) found.push_back({other, factor * ratio});
    };
    for (const Differential& differential : rover.differentials) {
      const double ratio = -position_sign(rover, differential);
      if (differential.joint_a == from) reach(differential.joint_b, ratio);
      if (differential.joint_b == from) reach(differential.joint_a, ratio);
    }
    for (const Gear& gear : rover.gears) {
      if (gear.joint_a == from) reach(gear.joint_b, gear.ratio);
      if (gear.joint_b == from) reach(gear.joint_a, 1 / gear.ratio);
    }
  }
  return found;
}

struct Loops {
  RowSet rows;          // three a loop: the velocity of its two points against each other
  Eigen::VectorXd gap;  // [m] (3 loops)
};

// Loops to the world of what moves freely are left out: where its root stands decides about them.
Loops look_at_loops(const Mechanism& mechanism, const Rover& rover) {
  mechanism.update_kinematics();
  Loops loops;
  std::vector<double> gap;
  for (const LoopClosure& closure : rover.loop_closures) {
    if (closure.body_b < 0 && !mechanism.held_by_world()) continue;
    const auto [a, b] = ends_of(mechanism, closure);
    for (int axis = 0; axis < 3; ++axis) {
      loops.rows.open(RowKind::coupling);
      mechanism.add_relative_jacobian(closure.body_a, closure.body_b, a, b, Vector3d::Unit(axis), loops.rows);
      gap.push_back((a - b)[axis]);
    }
  }
  loops.gap = Eigen::Map<const Eigen::VectorXd>(gap.data(), static_cast<Eigen::Index>(gap.size()));
  return loops;
}

// Moves joints that are not held until loops close (Gauss-Newton, least change), and turns their speeds to what loops allow. Joints in
// couplings stay. Returns the largest gap [m] that is left along an axis.
double close_loops(Mechanism& mechanism, const Rover& rover, const std::vector<bool>& held) {
  if (rover.loop_closures.empty()) return 0;
  Loops loops = look_at_loops(mechanism, rover);
  if (loops.gap.size() == 0) return 0;
  std::vector<int> moved;
  for (std::size_t j = 0; j < rover.joints.size(); ++j)
    if (!held[j] && rover.joints[j].has_one_freedom() && tied_to(rover, static_cast<int>(j)).size() == 1) moved.push_back(static_cast<int>(j));
  // Changes of the moved joints, by the least of them, that change the rows by -error.
  const auto least_change = [&](const Eigen::VectorXd& error) -> Eigen::VectorXd {
    Eigen::MatrixXd jacobian(error.size(), static_cast<Eigen::Index>(moved.size()));
    for (Eigen::Index c = 0; c < jacobian.cols(); ++c) {
      const Eigen::VectorXd unit = Eigen::VectorXd::Unit(mechanism.dofs(), mechanism.dof_of(moved[static_cast<std::size_t>(c)]));
      for (Eigen::Index r = 0; r < jacobian.rows(); ++r) jacobian(r, c) = loops.rows.dot(loops.rows[static_cast<int>(r)], unit);
    }
    Eigen::CompleteOrthogonalDecomposition<Eigen::MatrixXd> decomposition;
    decomposition.setThreshold(kSameRow);
    decomposition.compute(jacobian);
    return decomposition.solve(-error);
  };
  const auto shift = [&](const Eigen::VectorXd& position, const Eigen::VectorXd& velocity) {
    for (std::size_t k = 0; k < moved.size(); ++k) {
      const auto row = static_cast<Eigen::Index>(k);
      mechanism.set_joint(moved[k], mechanism.joint_position(moved[k]) + position[row], mechanism.joint_velocity(moved[k]) + velocity[row]);
    }
  };
  const Eigen::VectorXd none = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(moved.size()));
  for (int round = 0; round < kMostClosingRounds && !moved.empty() && loops.gap.cwiseAbs().maxCoeff() > kClosed; ++round) {
    Eigen::VectorXd change = least_change(loops.gap);
    const double largest = change.cwiseAbs().maxCoeff();
    if (largest > kLargestTurn) change *= kLargestTurn / largest;
    shift(change, none);
    loops = look_at_loops(mechanism, rover);
  }
  Eigen::VectorXd opening(loops.gap.size());  // [m/s]
  for (Eigen::Index r = 0; r < opening.size(); ++r) opening[r] = loops.rows.dot(loops.rows[static_cast<int>(r)], mechanism.velocity());
  if (!moved.empty() && opening.cwiseAbs().maxCoeff() > kClosed) shift(none, least_change(opening));
  return loops.gap.cwiseAbs().maxCoeff();
}

void put_joint(Mechanism& mechanism, const Rover& rover, int joint, const std::string& quantity, double value) {
  const bool position = quantity == "joint.position";
  std::vector<bool> held(rover.joints.size(), false);
  for (const auto& [j, factor] : tied_to(rover, joint)) {
    mechanism.set_joint(j, position ? factor * value : mechanism.joint_position(j), position ? mechanism.joint_velocity(j) : factor * value);
    held[static_cast<std::size_t>(j)] = true;
  }
  if (const double gap = close_loops(mechanism, rover, held); gap > kOpen)
    throw InputRefused(fmt::format("{} of '{}' cannot be {:g}: its loop would stay open by {:.3g} m", quantity,
                                   rover.joints[static_cast<std::size_t>(joint)].name, value, gap));
}

}  // namespace

void require_change(const Rover& rover, bool held_by_world, const StateChange& change) {
  const std::string who = fmt::format("{} of '{}'", change.quantity, change.target);
  const std::size_t numbers = numbers_of(change.quantity);
  if (numbers == 0)
    throw InputRefused(fmt::format("{} cannot be set; what can be set are joint.position, joint.velocity, part.position, part.orientation, "
                                   "part.linear_velocity and part.angular_velocity", who));
  if (change.values.size() != numbers)
    throw InputRefused(fmt::format("{} takes {} number{}, not {}; give as many", who, numbers, numbers == 1 ? "" : "s", change.values.size()));
  for (const double value : change.values)
    if (!(std::abs(value) <= kLongest)) throw InputRefused(fmt::format("{} cannot be {:g}; it must be within +-{:g}", who, value, kLongest));
  if (of_joint(change)) {
    const int index = find_named(rover.joints, change.target, "the change is of joint");
    const Joint& joint = rover.joints[static_cast<std::size_t>(index)];
    if (!joint.has_one_freedom()) throw InputRefused(fmt::format("{} cannot be set: the joint is neither a hinge nor prismatic", who));
    if (joint.limit && change.quantity == "joint.position" && (change.values[0] < joint.limit->lower || change.values[0] > joint.limit->upper))
      throw InputRefused(fmt::format("{} cannot be {:g}; its limits are {:g} and {:g}", who, change.values[0], joint.limit->lower, joint.limit->upper));
    return;
  }
  const int body = find_named(rover.bodies, change.target, "the change is of body");
  if (held_by_world) throw InputRefused(fmt::format("{} cannot be set: the world holds this model; set its joints", who));
  if (body != root_of(rover))
    throw InputRefused(fmt::format("{} cannot be set: it follows its joints; set those, or '{}', which no joint carries", who,
                                   rover.bodies[static_cast<std::size_t>(root_of(rover))].name));
  if (change.quantity == "part.orientation") {
    const double norm = std::hypot(std::hypot(change.values[0], change.values[1]), std::hypot(change.values[2], change.values[3]));
    if (std::abs(norm - 1) > 1e-3) throw InputRefused(fmt::format("{} has the length {:g}; a quaternion w x y z has the length 1", who, norm));
  }
}

void put_elsewhere(Mechanism& mechanism, const Rover& rover, const StateChange& change) {
  require_change(rover, mechanism.held_by_world(), change);
  mechanism.update_kinematics();
  if (of_joint(change)) {
    put_joint(mechanism, rover, find_named(rover.joints, change.target, "the change is of joint"), change.quantity, change.values[0]);
    return;
  }
  BodyState root = mechanism.body_state(root_of(rover));
  const std::vector<double>& v = change.values;
  if (change.quantity == "part.position") root.position = Vector3d(v[0], v[1], v[2]);
  if (change.quantity == "part.orientation") root.rotation = Quaterniond(v[0], v[1], v[2], v[3]).normalized();
  if (change.quantity == "part.linear_velocity") root.velocity = Vector3d(v[0], v[1], v[2]);
  if (change.quantity == "part.angular_velocity") root.angular_velocity = Vector3d(v[0], v[1], v[2]);
  mechanism.set_root(root);
}

LoopEnds ends_of(const Mechanism& mechanism, const LoopClosure& closure) {
  return {mechanism.to_world(closure.body_a, closure.point),
          closure.body_b < 0 ? closure.point : mechanism.to_world(closure.body_b, closure.point)};
}

void start_joints(Mechanism& mechanism, const Rover& rover, const Scenario& scenario) {
  if (scenario.initial_states.empty()) return;
  std::vector<const InitialJointState*> by(rover.joints.size(), nullptr);  // which state decided about a joint
  for (const InitialJointState& state : scenario.initial_states) {
    mechanism.set_joint(state.joint, state.position, state.velocity);
    by[static_cast<std::size_t>(state.joint)] = &state;
  }
  for (const InitialJointState& state : scenario.initial_states) {
    for (const auto& [j, factor] : tied_to(rover, state.joint)) {
      const InitialJointState*& other = by[static_cast<std::size_t>(j)];
      const auto differ = [&](double value, double wanted) { return std::abs(value - wanted) > kAgree * std::max(1.0, std::abs(wanted)); };
      if (other == nullptr) {
        mechanism.set_joint(j, factor * state.position, factor * state.velocity);
        other = &state;
      } else if (differ(mechanism.joint_position(j), factor * state.position) || differ(mechanism.joint_velocity(j), factor * state.velocity)) {
        const auto name = [&](int joint) { return rover.joints[static_cast<std::size_t>(joint)].name; };
        throw InputRefused(fmt::format(
            "scenario '{}' starts joint '{}' at {:g} with the speed {:g}, and joint '{}' at {:g} with the speed {:g}, but they are coupled: "
            "'{}' moves {:g} times as far; name one of them, and the other follows",
            scenario.name, name(state.joint), state.position, state.velocity, name(other->joint), other->position, other->velocity, name(j), factor));
      }
    }
  }
  std::vector<bool> held(rover.joints.size());
  std::transform(by.begin(), by.end(), held.begin(), [](const auto* state) { return state != nullptr; });
  if (const double gap = close_loops(mechanism, rover, held); gap > kOpen)
    throw InputRefused(fmt::format("joints as scenario '{}' starts them leave a loop open by {:.3g} m; name fewer of them, the others follow, "
                                   "or correct them", scenario.name, gap));
}

}  // namespace rille
