// Rigid contacts: wheels and hulls on rocks, hulls on the ground, wheels on ground as hard as rock.
//
// A contact is three rows: the normal one pushes only, stops the approach within the step (or sends the bodies apart with the restitution
// of the pair), and works overlap off slowly; two tangential ones hold like dry friction, |f_t| <= mu f_n (Coulomb).
//
// A contact that sticks has stiff tangential rows with bounds. One that slides has f_t = -(mu f_n / |u|) u with the sliding velocity u: two rows
// of one weight, so that friction opposes the sliding whichever way it goes. f_n and |u| come out of the same solution and are found by
// repeated solution, starting from the last step (a minimisation of the friction's power by its quadratic majorants, which converges).
#pragma once

#include <array>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "model/archive.hpp"
#include "model/model.hpp"
#include "model/result.hpp"
#include "physics/rows.hpp"
#include "world/collision.hpp"
#include "world/ground.hpp"
#include "world/mechanism.hpp"

namespace rille {

class RigidContacts {
 public:
  RigidContacts(const Model& model, const Mechanism& mechanism);

  // Finds the contacts of shapes and wheels with obstacles, and of shapes with the ground. Needs update_kinematics().
  void find(const Mechanism& mechanism, double h);
  // A wheel on ground that is as hard as rock.
  void add_wheel_on_ground(int wheel, int body, const Eigen::Vector3d& point, const Eigen::Vector3d& normal, double gap, const RigidPair& pair);
  // Appends three rows for each contact; returns whether there are any.
  bool open_rows(const Mechanism& mechanism, double h, RowSet& rows);
  // Adjusts friction to the last solution; returns whether they must be solved again.
  bool tighten(RowSet& rows, const Eigen::VectorXd& impulse, const Eigen::VectorXd& velocity);
  void close_rows(const Eigen::VectorXd& impulse, double h, double time, std::vector<Event>& events);

  // Force of obstacles and hard ground on a wheel in the last step [N] in W.
  const Eigen::Vector3d& wheel_force(int wheel) const { return wheel_force_[static_cast<std::size_t>(wheel)]; }
  // Deepest overlap with an obstacle [m, negative] and who it is, as of the last find().
  std::pair<double, std::string> deepest_overlap() const;

  void forget_touches() { last_touch_.clear(); }  // contacts that exist count as new ones again
  void visit(Archive& archive) { archive(last_normal_, last_slide_, last_touch_); }

 private:
  struct Contact {
    int mover = -1;     // wheel, then shapes
    int obstacle = -1;  // -1: the ground
    int body = -1;
    Eigen::Vector3d point = Eigen::Vector3d::Zero();   // [m] in W
    Eigen::Vector3d normal = Eigen::Vector3d::UnitZ(); // [-] towards the mover
    Eigen::Vector3d tangent_1 = Eigen::Vector3d::Zero(), tangent_2 = Eigen::Vector3d::Zero();
    double gap = 0;
    RigidPair pair;
    int row = -1;
    double strength = 0;    // [N s] largest friction in this round
    double stiffness = 0;   // [kg] weight of a tangential row that sticks
    bool slides = false;    // in this round
    bool was_stopped = false;  // slid in an earlier round of this step and came to rest
  };
  using Key = std::pair<int, int>;  // mover, obstacle

  const std::string& name(int mover) const;
  // Tangential rows of a contact that sticks within bounds [N s], and of one that slides at a speed [m/s].
  static void stick(Contact& contact, const std::array<double, 2>& bound, RowSet& rows);
  static void slide(Contact& contact, double speed, RowSet& rows);

  const Model* model_;
  Collision collision_;
  std::vector<Eigen::Quaterniond> axes_;               // of each mover in M
  std::vector<std::vector<Eigen::Vector3d>> corners_;  // of each shape in M
  std::vector<double> bound_;                          // [m] radius around each shape's centre
  std::vector<Contact> contacts_;
  std::vector<Touch> touches_;
  std::vector<Eigen::Vector3d> wheel_force_;
  int rounds_ = 0;
  std::vector<std::pair<Key, double>> last_normal_;  // [N s] impulse of each pair in the last step
  std::vector<std::pair<Key, Eigen::Vector3d>> last_slide_;  // [N s] friction of each pair that slid in the last step, in W
  std::vector<std::pair<Key, double>> last_touch_;   // [s] when a pair touched last
};

// Corners of a solid [m] in the frame that it is given in; round ones by the box around them.
std::vector<Eigen::Vector3d> corners_of(const Shape& shape);

}  // namespace rille
