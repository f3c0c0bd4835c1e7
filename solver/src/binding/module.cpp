// Python module rille._solver: the solver in process. Arrays are copies; the interpreter lock is released while stepping.

#include <fmt/format.h>
#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include "model/error.hpp"
#include "simulate/simulation.hpp"
#include "store/contract.hpp"
#include "store/load.hpp"

namespace nb = nanobind;
using namespace nb::literals;

namespace {

using rille::Simulation;
using Array = nb::ndarray<nb::numpy, double>;

Array array(std::vector<double> values, std::size_t rows, std::size_t columns) {
  auto* kept = new std::vector<double>(std::move(values));  // owned by the capsule below
  nb::capsule owner(kept, [](void* p) noexcept { delete static_cast<std::vector<double>*>(p); });
  return Array(kept->data(), {rows, columns}, owner);
}

Simulation make(const std::string& path, const std::optional<std::string>& scenario, const std::optional<double>& step) {
  rille::require_double_precision();
  SQLite::Database database = rille::open_database(path);
  rille::Model model = rille::load_model(database, scenario);
  if (step) {
    if (!(*step > 0 && *step <= 0.1))
      throw rille::InputRefused(fmt::format("step is {:g} s; it must be above 0 and at most 0.1 s", *step));
    model.scenario.step = *step;
  }
  return Simulation(std::move(model));
}

template <class Items>
std::vector<std::string> names(const Items& items) {
  std::vector<std::string> result;
  for (const auto& item : items) result.push_back(item.name);
  return result;
}

}  // namespace

NB_MODULE(_solver, module) {
  module.doc() = "The solver of rille in process.";
  module.attr("schema_version") = rille::contract::kSchemaVersion;
  nb::register_exception_translator([](const std::exception_ptr& pointer, void*) {
    try {
      std::rethrow_exception(pointer);
    } catch (const rille::InputRefused& error) {
      nb::object type = nb::module_::import_("rille.model").attr("InputRefused");
      PyErr_SetString(type.ptr(), error.what());
    }
  });

  nb::class_<Simulation>(module, "Simulation",
                         "One run in memory.\n\n"
                         "Simulation(path, scenario=None, step=None): reads model and scenario (by name; None: the only one)\n"
                         "from a database; step [s] overrides the scenario's. Raises rille.model.InputRefused.")
      .def("__init__",
           [](Simulation* self, const std::string& path, const std::optional<std::string>& scenario,
              const std::optional<double>& step) { new (self) Simulation(make(path, scenario, step)); },
           "path"_a, "scenario"_a = nb::none(), "step"_a = nb::none())
      .def("settle", [](Simulation& s) { return std::string(word(s.settle())); }, nb::call_guard<nb::gil_scoped_release>(),
           "Come to rest with drives held, for at most the scenario's settle_time. Returns the outcome.")
      .def("step",
           [](Simulation& s, long long count) {
             rille::Outcome outcome = s.outcome();
             for (long long k = 0; k < count && outcome == rille::Outcome::running; ++k) outcome = s.step();
             return std::string(word(outcome));
           },
           "count"_a = 1, nb::call_guard<nb::gil_scoped_release>(),
           "Advance by count steps. Returns 'running', or the outcome that ended the run.")
      .def_prop_ro("time", &Simulation::time, "Simulated time [s].")
      .def_prop_ro("message", [](const Simulation& s) { return s.message(); }, "The outcome in a sentence.")
      .def_prop_ro("body_names", [](const Simulation& s) { return names(s.model().rover.bodies); }, "Order of bodies().")
      .def_prop_ro("joint_names", [](const Simulation& s) { return names(s.model().rover.joints); }, "Order of joints().")
      .def_prop_ro("wheel_names", [](const Simulation& s) { return names(s.model().rover.wheels); }, "Order of wheels().")
      .def("bodies",
           [](const Simulation& s) {
             std::vector<double> v;
             const auto snapshot = s.snapshot();
             for (const auto& b : snapshot.bodies)
               v.insert(v.end(), {b.position.x(), b.position.y(), b.position.z(), b.rotation.w(), b.rotation.x(),
                                  b.rotation.y(), b.rotation.z(), b.velocity.x(), b.velocity.y(), b.velocity.z(),
                                  b.angular_velocity.x(), b.angular_velocity.y(), b.angular_velocity.z()});
             return array(std::move(v), snapshot.bodies.size(), 13);
           },
           "Shape (n_bodies, 13): position [m], quaternion w x y z, velocity [m/s], angular velocity [rad/s], all in W.")
      .def("joints",
           [](const Simulation& s) {
             std::vector<double> v;
             const auto snapshot = s.snapshot();
             for (const auto& j : snapshot.joints) v.insert(v.end(), {j.position, j.velocity, j.effort, j.work});
             return array(std::move(v), snapshot.joints.size(), 4);
           },
           "Shape (n_joints, 4): position [rad or m], velocity, drive effort [N m or N], drive work [J].")
      .def("wheels",
           [](const Simulation& s) {
             std::vector<double> v;
             const auto snapshot = s.snapshot();
             for (const auto& w : snapshot.wheels)
               v.insert(v.end(), {w.center.x(), w.center.y(), w.center.z(), w.ground_height, w.slip_ratio, w.slip_angle,
                                  w.sinkage, w.normal_load, w.drawbar_pull, w.side_force, w.drive_torque});
             return array(std::move(v), snapshot.wheels.size(), 11);
           },
           "Shape (n_wheels, 11): centre x y z [m], ground height [m], slip ratio, slip angle [rad], sinkage [m], normal load,\n"
           "drawbar pull, side force [N], drive torque [N m].")
      .def_prop_ro("kinetic_energy",
                   [](Simulation& s) {
                     s.mechanism().update_kinematics();
                     s.mechanism().update_mass_matrix();
                     return s.mechanism().kinetic_energy();
                   },
                   "Kinetic energy [J].")
      .def_prop_ro("potential_energy",
                   [](Simulation& s) {
                     s.mechanism().update_kinematics();
                     return s.mechanism().potential_energy();
                   },
                   "Potential energy [J] against z = 0.")
      .def_prop_ro("momentum",
                   [](Simulation& s) {
                     s.mechanism().update_kinematics();
                     const auto p = s.mechanism().momentum();
                     return array({p.data(), p.data() + 6}, 1, 6);
                   },
                   nb::rv_policy::move, "Shape (1, 6): momentum [N s] and angular momentum about the origin of W [N m s].")
      .def_prop_ro("differential_error", &Simulation::largest_differential_error,
                   "Largest error of theta_a + theta_b = 2 theta_carrier over all differentials [rad].");
}
