// Python module rille._solver: the solver in process. Arrays are copies; the interpreter lock is released while stepping.

#include <fmt/format.h>
#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <map>

#include "model/error.hpp"
#include "physics/sinkage.hpp"
#include "physics/slip.hpp"
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

rille::Soil soil_from(const nb::dict& values) {
  rille::Soil soil;
  const auto number = [&](const char* key) { return nb::cast<double>(values[key]); };
  soil.sinkage_exponent = number("sinkage_exponent");
  soil.cohesive_modulus = number("cohesive_modulus");
  soil.frictional_modulus = number("frictional_modulus");
  soil.cohesion = number("cohesion");
  soil.friction_angle = number("friction_angle");
  soil.shear_modulus = number("shear_modulus");
  soil.lateral_shear_modulus = number("lateral_shear_modulus");
  soil.peak_angle_offset = number("peak_angle_offset");
  soil.peak_angle_slip = number("peak_angle_slip");
  soil.exit_sinkage_ratio = number("exit_sinkage_ratio");
  if (values.contains("unit_weight")) soil.unit_weight = number("unit_weight");
  if (values.contains("reece_cohesive_modulus") && !values["reece_cohesive_modulus"].is_none())
    soil.reece_cohesive_modulus = number("reece_cohesive_modulus");
  if (values.contains("reece_frictional_modulus") && !values["reece_frictional_modulus"].is_none())
    soil.reece_frictional_modulus = number("reece_frictional_modulus");
  return soil;
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

  module.def(
      "wheel_under_load",
      [](const std::string& law, const nb::dict& soil_values, double radius, double width, double load, double slip_ratio) {
        const std::map<std::string, rille::WheelSoilLaw> laws = {{"bekker", rille::WheelSoilLaw::bekker},
                                                                 {"bekker_wong", rille::WheelSoilLaw::bekker_wong},
                                                                 {"reece", rille::WheelSoilLaw::reece}};
        if (!laws.contains(law))
          throw rille::InputRefused(fmt::format("the wheel-soil law '{}' is unknown; known: bekker, bekker_wong, reece", law));
        const rille::Soil soil = soil_from(soil_values);
        const double travel = slip_ratio >= 0 ? 1 - slip_ratio : 1 / std::max(1 + slip_ratio, 1e-3);
        const auto found = rille::sinkage_under_load(laws.at(law), soil, {radius, width}, {0, slip_ratio, travel, 0}, load);
        if (!found.found)
          throw rille::InputRefused(fmt::format("a wheel of radius {:g} m and width {:g} m sinks to its axle before the soil carries {:g} N", radius,
                                                width, load));
        nb::dict answer;
        answer["sinkage"] = found.sinkage;
        answer["normal_load"] = found.reaction.normal_load;
        answer["drawbar_pull"] = found.reaction.drawbar_pull;
        answer["drive_torque"] = found.reaction.torque;
        answer["entry_angle"] = found.reaction.entry_angle;
        answer["peak_angle"] = found.reaction.peak_angle;
        answer["exit_angle"] = found.reaction.exit_angle;
        return answer;
      },
      "law"_a, "soil"_a, "radius"_a, "width"_a, "load"_a, "slip_ratio"_a,
      "Steady rolling of one wheel under a load [N] at a slip ratio in [-1, 1]: sinkage [m], forces [N], torque [N m], angles [rad].\n\n"
      "soil: dict of the columns of table soil (SI), and unit_weight [N/m^3] for Reece moduli. Raises rille.model.InputRefused if the\n"
      "soil does not carry the load. Source: Wong & Reece 1967, eqs 3-9; see solver/src/physics/wheel_soil.hpp.");

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
