// Measurable quantities by their names in the controlled vocabulary, for sensors and watches.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "model/model.hpp"
#include "model/result.hpp"
#include "world/mechanism.hpp"

namespace rille {

// What a quantity is read from; kinematics are up to date.
struct Readable {
  const Model* model;
  const Mechanism* mechanism;
  const std::vector<JointState>* joints;  // by joint
  const std::vector<WheelState>* wheels;  // by wheel
  double h;                               // [s] length of the last step
};

class Quantity {
 public:
  // Raises InputRefused for a quantity that does not exist, a target that the model does not have, or data that it lacks.
  // who: "sensor 'imu'", for the sentence.
  Quantity(const Rover& rover, const std::string& quantity, const std::string& target, bool body_frame, const std::string& who);

  int size() const { return size_; }
  // Current values [SI]. Accelerations compare with the velocity of the last call: call it once a step.
  std::vector<double> read(const Readable& from);
  bool needs_every_step() const { return kind_ == Kind::linear_acceleration; }

  template <class Archive>
  void visit(Archive& archive) {
    archive(last_velocity_, has_last_);
  }

 private:
  enum class Kind { joint, wheel, position, orientation, linear_velocity, angular_velocity, linear_acceleration, current, voltage };

  Kind kind_ = Kind::joint;
  int index_ = -1;  // of the joint, wheel or body
  int drive_ = -1;
  int size_ = 1;
  bool body_frame_ = false;
  double JointState::* joint_ = nullptr;
  double WheelState::* wheel_ = nullptr;
  Eigen::Vector3d last_velocity_ = Eigen::Vector3d::Zero();
  bool has_last_ = false;
};

}  // namespace rille
