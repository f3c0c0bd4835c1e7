// Python module rille._solver: the solver in process. Arrays are copies; the interpreter lock is released while stepping.

#include <fmt/format.h>
#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>
#include <nanobind/stl/map.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <nanobind/stl/pair.h>
#include <nanobind/stl/tuple.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <memory>

#include "effects/registry.hpp"
#include "model/error.hpp"
#include "model/named.hpp"
#include "model/soil_range.hpp"
#include "physics/sinkage.hpp"
#include "physics/slip.hpp"
#include "run/recorded_run.hpp"
#include "simulate/bench.hpp"
#include "simulate/parameters.hpp"
#include "simulate/simulation.hpp"
#include "simulate/windows.hpp"
#include "store/contract.hpp"
#include "store/load.hpp"
#include "world/ground.hpp"

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

rille::Model load(const std::string& path, const std::optional<std::string>& scenario, const std::optional<double>& step) {
  rille::require_double_precision();
  SQLite::Database database = rille::open_database(path);
  rille::Model model = rille::load_model(database, scenario);
  if (step) model.scenario.step = *step;
  rille::require_step(model.scenario.step);
  return model;
}

// (kind, target kind, target, {parameter: number}[, formula, output, {constant: (value, unit)}]), complete: Python knows the catalogue.
rille::EffectRow effect_from(const nb::tuple& row, const rille::Rover& rover) {
  rille::EffectRow effect;
  effect.kind = nb::cast<std::string>(row[0]);
  effect.target_name = nb::cast<std::string>(row[2]);
  for (const auto& [key, value] : nb::cast<nb::dict>(row[3])) effect.parameters[nb::cast<std::string>(key)] = nb::cast<double>(value);
  if (row.size() > 4) {
    effect.formula = nb::cast<std::string>(row[4]);
    effect.output = nb::cast<std::string>(row[5]);
    for (const auto& [key, value] : nb::cast<nb::dict>(row[6])) {
      const auto pair = nb::cast<std::pair<double, std::string>>(value);
      effect.constants[nb::cast<std::string>(key)] = {pair.first, pair.second};
    }
  }
  rille::aim(effect, nb::cast<std::string>(row[1]), rover);
  return effect;
}

std::vector<rille::EffectRow> effects_from(const nb::list& rows, const rille::Rover& rover) {
  std::vector<rille::EffectRow> effects;
  for (const auto& row : rows) effects.push_back(effect_from(nb::cast<nb::tuple>(row), rover));
  return effects;
}

// A state as measured: time, pose of the root's body frame (position, quaternion w x y z), its velocity and angular velocity in W, then
// positions and velocities of the joints of one freedom in their order.
std::vector<int> single_joints(const Simulation& simulation) {
  std::vector<int> joints;
  const auto& all = simulation.model().rover.joints;
  for (std::size_t j = 0; j < all.size(); ++j)
    if (all[j].has_one_freedom()) joints.push_back(static_cast<int>(j));
  return joints;
}

// The body that no joint carries; -1: the world holds the mechanism.
int free_root(const rille::Rover& rover) {
  std::vector<bool> carried(rover.bodies.size(), false);
  for (const auto& joint : rover.joints) carried[static_cast<std::size_t>(joint.child)] = true;
  const auto found = std::find(carried.begin(), carried.end(), false);
  return found == carried.end() ? -1 : static_cast<int>(found - carried.begin());
}

std::vector<double> state_row(Simulation& simulation) {
  auto& mechanism = simulation.mechanism();
  mechanism.update_kinematics();
  const int root = free_root(simulation.model().rover);
  const rille::BodyState b = root >= 0 ? mechanism.body_state(root) : rille::BodyState{};
  std::vector<double> row = {simulation.time(), b.position.x(), b.position.y(), b.position.z(), b.rotation.w(), b.rotation.x(), b.rotation.y(),
                             b.rotation.z(), b.velocity.x(), b.velocity.y(), b.velocity.z(), b.angular_velocity.x(), b.angular_velocity.y(),
                             b.angular_velocity.z()};
  const auto joints = single_joints(simulation);
  for (const int j : joints) row.push_back(mechanism.joint_position(j));
  for (const int j : joints) row.push_back(mechanism.joint_velocity(j));
  return row;
}

// Puts the mechanism where the row says; what a row does not hold (spherical joints) stays.
void place_at_row(Simulation& simulation, const double* row, std::size_t size) {
  const auto joints = single_joints(simulation);
  const std::size_t n = joints.size();
  if (size != 14 + 2 * n) throw rille::InputRefused(fmt::format("a state has {} numbers; this model needs {}", size, 14 + 2 * n));
  for (std::size_t k = 0; k < size; ++k)
    if (!std::isfinite(row[k])) throw rille::InputRefused(fmt::format("number {} of a state is not finite", k));
  const Eigen::Quaterniond rotation(row[4], row[5], row[6], row[7]);
  if (std::abs(rotation.norm() - 1) > 1e-3) throw rille::InputRefused(fmt::format("the quaternion of a state has the length {:g}, not 1", rotation.norm()));
  auto& mechanism = simulation.mechanism();
  for (std::size_t k = 0; k < n; ++k) mechanism.set_joint(joints[k], row[14 + k], row[14 + n + k]);
  mechanism.set_root({.position = {row[1], row[2], row[3]}, .rotation = rotation.normalized(), .velocity = {row[8], row[9], row[10]},
                      .angular_velocity = {row[11], row[12], row[13]}});
  mechanism.update_kinematics();
}

nb::ndarray<nb::numpy, float> view(const Simulation& s, const std::tuple<double, double, double>& origin) {
  const Eigen::Vector3d o(std::get<0>(origin), std::get<1>(origin), std::get<2>(origin));
  const rille::Snapshot now = s.snapshot();
  auto values = std::make_unique<std::vector<float>>();
  const auto add = [&](std::initializer_list<double> numbers) {
    for (const double number : numbers) values->push_back(static_cast<float>(number));
  };
  for (const auto& b : now.bodies) {
    const Eigen::Vector3d p = b.position - o;
    add({p.x(), p.y(), p.z(), b.rotation.w(), b.rotation.x(), b.rotation.y(), b.rotation.z()});
  }
  for (std::size_t j = 0; j < now.joints.size(); ++j)
    if (s.model().rover.joints[j].has_one_freedom()) add({now.joints[j].position, now.joints[j].velocity, now.joints[j].effort, now.joints[j].work});
  for (const auto& w : now.wheels) {
    const Eigen::Vector3d p = w.center - o;
    add({p.x(), p.y(), p.z(), w.ground_height - o.z(), w.slip_ratio, w.slip_angle, w.sinkage, w.normal_load, w.drawbar_pull, w.side_force, w.drive_torque});
  }
  std::vector<float>* kept = values.release();
  nb::capsule owner(kept, [](void* p) noexcept { delete static_cast<std::vector<float>*>(p); });
  const std::size_t size = kept->size();
  return nb::ndarray<nb::numpy, float>(kept->data(), {size}, owner);
}

// Numbers (a, b, c, d) that Python owns.
nb::ndarray<nb::numpy, double> block(std::unique_ptr<std::vector<double>> values, std::initializer_list<std::size_t> shape) {
  std::vector<double>* kept = values.release();
  nb::capsule owner(kept, [](void* p) noexcept { delete static_cast<std::vector<double>*>(p); });
  return nb::ndarray<nb::numpy, double>(kept->data(), shape.size(), shape.begin(), owner);
}

using Rows = nb::ndarray<double, nb::c_contig, nb::device::cpu>;

// (windows, size) for all models, or (models, windows, size).
nb::ndarray<nb::numpy, double> windows(const std::vector<rille::Model*>& models, const Rows& motions, long long n_steps, long long every,
                                       const rille::ChannelNames& channels, int threads, bool from_start) {
  if (n_steps < 1 || every < 1) throw rille::InputRefused("windows need n_steps and every of at least 1");
  const bool own = motions.ndim() == 3;
  if (motions.ndim() != 2 && (!own || motions.shape(0) != models.size()))
    throw rille::InputRefused("windows need motions (windows, numbers), or (models, windows, numbers)");
  const rille::Motions rows{.data = motions.data(), .models = own ? models.size() : 1, .windows = motions.shape(own ? 1 : 0), .size = motions.shape(own ? 2 : 1)};
  const std::size_t n_samples = static_cast<std::size_t>(n_steps / every) + (from_start ? 1 : 0);
  auto values = std::make_unique<std::vector<double>>(models.size() * rows.windows * n_samples * channels.size());
  {
    nb::gil_scoped_release release;
    rille::run_windows(models, rows, n_steps, every, channels, threads, from_start, values->data());
  }
  return block(std::move(values), {models.size(), rows.windows, n_samples, channels.size()});
}

// (variants, windows, size) for all models, or (models, variants, windows, size).
std::pair<nb::ndarray<nb::numpy, double>, std::vector<nb::bytes>> carried(const std::vector<rille::Model*>& models, const Rows& motions,
                                                                          const std::vector<long long>& n_steps, const rille::ChannelNames& channels,
                                                                          const std::vector<nb::bytes>& begin, double next_start, int threads) {
  const bool own = motions.ndim() == 4;
  if (motions.ndim() != 3 && (!own || motions.shape(0) != models.size()))
    throw rille::InputRefused("carried windows need motions (variants, windows, numbers), or (models, variants, windows, numbers)");
  const std::size_t first = own ? 1 : 0;
  const rille::Motions rows{.data = motions.data(), .models = own ? models.size() : 1, .variants = motions.shape(first),
                            .windows = motions.shape(first + 1), .size = motions.shape(first + 2)};
  if (rows.variants < 1) throw rille::InputRefused("carried windows need at least one variant");
  const std::size_t most = n_steps.empty() ? 0 : static_cast<std::size_t>(std::max(0LL, *std::max_element(n_steps.begin(), n_steps.end())));
  rille::Hidden hidden;
  for (const nb::bytes& state : begin) hidden.emplace_back(state.c_str(), state.size());
  auto values = std::make_unique<std::vector<double>>(models.size() * rows.variants * rows.windows * (most + 1) * channels.size());
  {
    nb::gil_scoped_release release;
    hidden = rille::run_carried(models, rows, n_steps, channels, hidden, next_start, threads, values->data());
  }
  std::vector<nb::bytes> end;
  for (const std::string& state : hidden) end.emplace_back(state.data(), state.size());
  return {block(std::move(values), {models.size(), rows.variants, rows.windows, most + 1, channels.size()}), std::move(end)};
}

// (joint a, joint b, ratio) of every differential and gear: q_b = ratio q_a.
std::vector<std::tuple<std::string, std::string, double>> ratios(const rille::Rover& rover) {
  std::vector<std::tuple<std::string, std::string, double>> found;
  const auto joint = [&](int index) -> const rille::Joint& { return rover.joints[static_cast<std::size_t>(index)]; };
  for (const auto& differential : rover.differentials) {
    const rille::Joint &a = joint(differential.joint_a), &b = joint(differential.joint_b);
    found.emplace_back(a.name, b.name, a.axis.dot(b.axis) > 0 ? -1.0 : 1.0);
  }
  for (const auto& gear : rover.gears) found.emplace_back(joint(gear.joint_a).name, joint(gear.joint_b).name, gear.ratio);
  return found;
}

const char* word(rille::JointKind kind) {
  switch (kind) {
    case rille::JointKind::hinge: return "hinge";
    case rille::JointKind::prismatic: return "prismatic";
    case rille::JointKind::fixed: return "fixed";
    case rille::JointKind::spherical: return "spherical";
  }
  return "";
}

const char* word(rille::Integrator integrator) {
  switch (integrator) {
    case rille::Integrator::automatic: return "auto";
    case rille::Integrator::semi_implicit_euler: return "semi_implicit_euler";
    case rille::Integrator::rk4: return "rk4";
  }
  return "";
}

const char* word(rille::DriveMode mode) {
  return mode == rille::DriveMode::speed ? "speed" : mode == rille::DriveMode::torque ? "torque" : "position";
}

// (drive, joint, mode) of every drive.
std::vector<std::tuple<std::string, std::string, std::string>> drives(const rille::Rover& rover) {
  std::vector<std::tuple<std::string, std::string, std::string>> found;
  for (const auto& drive : rover.drives) {
    found.emplace_back(drive.name, rover.joints[static_cast<std::size_t>(drive.joint)].name, word(drive.mode));
  }
  return found;
}

nb::tuple triple(const Eigen::Vector3d& v) { return nb::make_tuple(v.x(), v.y(), v.z()); }

// Lists of tuples, in the order of the fields of rille.model.machine.
nb::dict facts(const rille::Model& model) {
  const rille::Rover& rover = model.rover;
  const auto body = [&](int index) { return index < 0 ? std::string() : rover.bodies[static_cast<std::size_t>(index)].name; };
  const auto joint = [&](int index) { return rover.joints[static_cast<std::size_t>(index)].name; };
  nb::list bodies, joints, drives, wheels, sensors, soils;
  for (const auto& b : rover.bodies) bodies.append(nb::make_tuple(b.name, b.mass, triple(b.com), triple(b.frame)));
  for (const auto& j : rover.joints) joints.append(nb::make_tuple(j.name, word(j.kind), body(j.parent), body(j.child), triple(j.point), triple(j.axis),
                                 j.limit ? j.limit->lower : -std::numeric_limits<double>::infinity(),
                                 j.limit ? j.limit->upper : std::numeric_limits<double>::infinity()));
  for (const auto& d : rover.drives)
    drives.append(nb::make_tuple(d.name, joint(d.joint), word(d.mode), d.max_torque, d.max_speed, d.speed_gain, d.torque_constant, d.resistance));
  std::vector<bool> shown;
  if (model.terrain) {
    shown.assign(model.terrain->soils.size(), false);
    shown[static_cast<std::size_t>(model.terrain->base_soil)] = true;
    for (const auto& patch : model.terrain->patches) shown[static_cast<std::size_t>(patch.soil)] = true;
    for (std::size_t s = 0; s < shown.size(); ++s)
      if (shown[s]) soils.append(model.terrain->soil_names[s]);
  }
  for (std::size_t w = 0; w < rover.wheels.size(); ++w) {
    const auto& wheel = rover.wheels[w];
    bool soft = false;
    for (std::size_t s = 0; s < shown.size(); ++s) soft = soft || (shown[s] && model.terrain->response[w][s] != rille::WheelSoilLaw::rigid);
    wheels.append(nb::make_tuple(wheel.name, joint(wheel.joint), wheel.radius, wheel.width, wheel.grouser_count, wheel.grouser_height, soft));
  }
  for (const auto& s : rover.sensors) sensors.append(nb::make_tuple(s.name, s.quantity, s.target));
  nb::dict all;
  all["bodies"] = bodies;
  all["joints"] = joints;
  all["drives"] = drives;
  all["wheels"] = wheels;
  all["sensors"] = sensors;
  all["soils"] = soils;
  all["terrain"] = model.terrain ? model.terrain->name : std::string();
  all["gravity"] = model.scenario.gravity.norm();
  return all;
}

rille::Soil soil_from(const nb::dict& values) {
  rille::Soil soil;
  soil.damping = 3e4;
  for (const rille::SoilNumber& number : rille::kSoilNumbers)
    if (values.contains(number.name)) soil.*number.value = nb::cast<double>(values[number.name]);
  if (values.contains("unit_weight")) soil.unit_weight = nb::cast<double>(values["unit_weight"]);
  if (values.contains("reece_cohesive_modulus") && !values["reece_cohesive_modulus"].is_none())
    soil.reece_cohesive_modulus = nb::cast<double>(values["reece_cohesive_modulus"]);
  if (values.contains("reece_frictional_modulus") && !values["reece_frictional_modulus"].is_none())
    soil.reece_frictional_modulus = nb::cast<double>(values["reece_frictional_modulus"]);
  rille::require_valid(soil, "the soil");
  return soil;
}

template <class Items>
std::vector<std::string> names(const Items& items) {
  std::vector<std::string> result;
  for (const auto& item : items) result.push_back(item.name);
  return result;
}

void refuse(const std::string& sentence) {
  nb::object type = nb::module_::import_("rille.model").attr("InputRefused");
  // A damaged file is quoted as it is, be it text or not.
  const nb::object text = nb::steal(PyUnicode_DecodeUTF8(sentence.data(), static_cast<Py_ssize_t>(sentence.size()), "replace"));
  PyErr_SetObject(type.ptr(), text.ptr());
}

}  // namespace

NB_MODULE(_solver, module) {
  module.doc() = "The solver of rille in process.";
  module.attr("schema_version") = rille::contract::kSchemaVersion;
  nb::register_exception_translator([](const std::exception_ptr& pointer, void*) {
    try {
      std::rethrow_exception(pointer);
    } catch (const rille::InputRefused& error) {
      refuse(error.what());
    } catch (const SQLite::Exception& error) {
      refuse(fmt::format("the database could not be read or written: {}; what was committed is readable", error.what()));
    }
  });

  module.def(
      "wheel_under_load",
      [](const std::string& law, const nb::dict& soil_values, double radius, double width, double load, double slip_ratio) {
        const rille::Soil soil = soil_from(soil_values);
        rille::require_within(radius, rille::kAboveZero, rille::kAny, "radius of the wheel");
        rille::require_within(width, rille::kAboveZero, rille::kAny, "width of the wheel");
        rille::require_within(load, rille::kAboveZero, rille::kAny, "load of the wheel");
        rille::require_within(slip_ratio, -1, 1, "slip ratio of the wheel");
        const double travel = slip_ratio >= 0 ? 1 - slip_ratio : 1 / std::max(1 + slip_ratio, 1e-3);
        const auto found = rille::sinkage_under_load(rille::soft_soil_law(law), soil, {radius, width}, {0, slip_ratio, travel, 0}, load);
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

  module.def("known_effects", &rille::known_effects, "Names of the effects that this solver has.");
  module.def(
      "bench",
      [](const std::string& law, const nb::dict& soil, const nb::dict& wheel,
         const nb::ndarray<double, nb::ndim<2>, nb::c_contig, nb::device::cpu>& cases, const std::string& method, const nb::list& effects,
         double speed, double step, double longest, int threads) {
        rille::require_double_precision();
        if (cases.shape(1) != 3) throw rille::InputRefused("bench cases need three columns: load [N], slip ratio, slip angle [rad]");
        if (method != "quasi_static" && method != "dynamic")
          throw rille::InputRefused(fmt::format("the method of a bench is '{}'; use quasi_static or dynamic", method));
        rille::Bench rig;
        rig.wheel.name = "wheel";
        rig.wheel.radius = nb::cast<double>(wheel["radius"]);
        rig.wheel.width = nb::cast<double>(wheel["width"]);
        if (wheel.contains("grouser_count")) rig.wheel.grouser_count = nb::cast<int>(wheel["grouser_count"]);
        if (wheel.contains("grouser_height")) rig.wheel.grouser_height = nb::cast<double>(wheel["grouser_height"]);
        rig.soils = {soil_from(soil)};
        rille::Rover rover;
        rover.wheels = {rig.wheel};
        rig.effects = effects_from(effects, rover);
        for (rille::EffectRow& effect : rig.effects) effect.index = -1;
        rig.speed = speed;
        rig.step = step;
        rig.longest = longest;
        std::vector<rille::BenchCase> list;
        for (std::size_t k = 0; k < cases.shape(0); ++k) list.push_back({0, rille::soft_soil_law(law), cases(k, 0), cases(k, 1), cases(k, 2)});
        const rille::BenchMethod how = method == "dynamic" ? rille::BenchMethod::dynamic : rille::BenchMethod::quasi_static;
        std::vector<rille::BenchPoint> points;
        {
          nb::gil_scoped_release release;
          points = rille::run_bench(rig, list, how, threads);
        }
        std::vector<double> values;
        std::vector<std::string> status;
        for (const rille::BenchPoint& p : points) {
          values.insert(values.end(), {p.sinkage, p.drawbar_pull, p.side_force, p.drive_torque, p.normal_load, p.entry_angle, p.peak_angle, p.exit_angle});
          status.emplace_back(word(p.status));
        }
        return nb::make_tuple(array(std::move(values), points.size(), 8), status);
      },
      "law"_a, "soil"_a, "wheel"_a, "cases"_a, "method"_a = "quasi_static", "effects"_a = nb::list(), "speed"_a = 0.05, "step"_a = 1e-3,
      "longest"_a = 60.0, "threads"_a = 0,
      "Single-wheel bench. cases: (n, 3) load [N], slip ratio [-], slip angle [rad]. wheel: radius, width [m], grouser_count, grouser_height [m].\n\n"
      "Returns (n, 8) sinkage [m], drawbar_pull, side_force [N], drive_torque [N m], normal_load [N], entry, peak and exit angle [rad]\n"
      "(angles: quasi_static only), and n words: done, not_carried, not_settled. See solver/src/simulate/bench.hpp.");
  module.def("windows", &windows, "models"_a, "motions"_a, "n_steps"_a, "every"_a, "channels"_a, "threads"_a = 0, "from_start"_a = false,
             "Short simulations in batch, over threads. motions: (n_windows, 8 + n_q + n_v), rows of Simulation.motion(), or of each model\n"
             "its own, (n_models, n_windows, 8 + n_q + n_v); channels: list of\n"
             "(quantity, target, component). Returns (n_models, n_windows, n_steps // every, n_channels), NaN after a run has ended;\n"
             "from_start: one sample more, before the first step. Of the commands each window is given those of its own time, and from so long\n"
             "before as effects delay them. The same numbers for any number of threads.");
  module.def("carried", &carried, "models"_a, "motions"_a, "n_steps"_a, "channels"_a, "begin"_a = std::vector<nb::bytes>(),
             "next_start"_a = std::nan(""), "threads"_a = 0,
             "Windows one after the other: what is not motion (ruts, integrals, lags, states of effects) goes on from the run of the first\n"
             "variant as it was where the next window begins; only the motion is put there. motions: (k, n_windows, numbers) or of each model\n"
             "its own, (n_models, k, n_windows, numbers), times ascending; n_steps: of each window. Returns (n_models, k, n_windows,\n"
             "max(n_steps) + 1, n_channels), filled with NaN, and the hidden state of each model at the time next_start [s] of the window\n"
             "that a further call goes on with (begin). The same numbers for any number of threads.");

  nb::class_<rille::Model>(module, "Model",
                           "A model in memory: read once, changed without reading again.\n\n"
                           "Model(path, scenario=None, step=None). Raises rille.model.InputRefused.")
      .def("__init__",
           [](rille::Model* self, const std::string& path, const std::optional<std::string>& scenario, const std::optional<double>& step) {
             new (self) rille::Model(load(path, scenario, step));
           },
           "path"_a, "scenario"_a = nb::none(), "step"_a = nb::none())
      .def("copy", [](const rille::Model& m) { return rille::Model(m); }, "An independent copy; heights are shared.")
      .def("get", [](rille::Model& m, const std::string& name) { return rille::get_parameter(m, name); }, "name"_a, "Value of a parameter [SI].")
      .def("set", [](rille::Model& m, const std::string& name, double value) { rille::set_parameter(m, name, value); }, "name"_a, "value"_a,
           "Set a parameter [SI]; simulations made from now on have it. Raises rille.model.InputRefused for a value outside its bounds.")
      .def("parameters",
           [](rille::Model& m) {
             nb::dict all;
             for (const auto& parameter : rille::parameters(m)) all[parameter.name.c_str()] = *parameter.place;
             return all;
           },
           "Every parameter by name with its value [SI].")
      .def("bounds",
           [](rille::Model& m) {
             nb::dict all;
             for (const auto& parameter : rille::parameters(m))
               all[parameter.name.c_str()] = nb::make_tuple(*parameter.place, parameter.lower, parameter.upper);
             return all;
           },
           "Every parameter by name with its value, its smallest and its largest [SI].")
      .def("add_effect",
           [](rille::Model& m, const std::string& kind, const std::string& target, const std::map<std::string, double>& numbers,
              const std::string& target_kind, const std::string& formula, const std::string& output,
              const std::map<std::string, std::pair<double, std::string>>& constants) {
             rille::EffectRow effect;
             effect.kind = kind;
             effect.target_name = target;
             effect.parameters = numbers;
             effect.formula = formula;
             effect.output = output;
             for (const auto& [name, constant] : constants) effect.constants[name] = {constant.first, constant.second};
             rille::add_effect(m, std::move(effect), target_kind);
           },
           "kind"_a, "target"_a, "numbers"_a, "target_kind"_a = "", "formula"_a = "", "output"_a = "",
           "constants"_a = std::map<std::string, std::pair<double, std::string>>(),
           "Add an effect to those of the model; numbers that are not given are those of the catalogue. Raises rille.model.InputRefused.")
      .def_prop_ro("effects", [](const rille::Model& m) {
             nb::list all;
             for (const auto& effect : m.effects) {
               nb::dict constants;
               for (const auto& [name, constant] : effect.constants) constants[name.c_str()] = nb::make_tuple(constant.value, constant.unit);
               all.append(nb::make_tuple(effect.kind, effect.target_name, effect.parameters, effect.formula, effect.output, constants));
             }
             return all;
           }, "(kind, target, {parameter: value}, formula, output, {constant: (value, unit)}) of every effect of the model.")
      .def_prop_ro("has_memory", [](const rille::Model& m) { return rille::has_memory(m); },
                   "Whether what the model does depends on what was before a motion: effects with a state, drives that integrate.")
      .def_prop_ro("command_delay", [](const rille::Model& m) { return rille::longest_command_delay(m); },
                   "Longest time [s] by which effects make a command reach its drive late.")
      .def_prop_ro("facts", [](const rille::Model& m) { return facts(m); },
                   "Names and numbers of bodies, joints, drives, wheels, sensors and ground, as rille.model.machine takes them.")
      .def("set_step", [](rille::Model& m, double step) {
             rille::require_step(step);
             m.scenario.step = step;
           }, "step"_a, "Set the time step [s]. Raises rille.model.InputRefused.")
      .def("set_integrator", [](rille::Model& m, const std::string& name) {
             const auto known = {rille::Integrator::automatic, rille::Integrator::semi_implicit_euler, rille::Integrator::rk4};
             const auto found = std::find_if(known.begin(), known.end(), [&](rille::Integrator i) { return name == word(i); });
             if (found == known.end()) throw rille::InputRefused(fmt::format("the integrator is '{}'; use auto, semi_implicit_euler or rk4", name));
             m.scenario.integrator = *found;
           }, "name"_a, "Set the integrator: auto, semi_implicit_euler or rk4. Raises rille.model.InputRefused.")
      .def("set_effects", [](rille::Model& m, const nb::list& rows) { m.effects = effects_from(rows, m.rover); }, "rows"_a,
           "Replace the effects: (kind, target kind, target, {parameter: value}); rille.simulate.effect_rows makes them.")
      .def("ground_height",
           [](const rille::Model& m, const nb::ndarray<double, nb::ndim<2>, nb::c_contig, nb::device::cpu>& points) {
             if (!m.terrain) throw rille::InputRefused("the scenario has no ground; give it a terrain");
             if (points.shape(1) != 2) throw rille::InputRefused(fmt::format("points have {} columns; they need two, x and y", points.shape(1)));
             const rille::Ground ground(*m.terrain);
             std::vector<double> heights;
             heights.reserve(points.shape(0));
             for (std::size_t k = 0; k < points.shape(0); ++k)
               heights.push_back(ground.height(points(k, 0), points(k, 1)).value_or(std::nan("")));
             const std::size_t n = heights.size();
             return array(std::move(heights), n, 1);
           },
           "points"_a, "Height [m] of the ground under wheels at points (n, 2) of W, shape (n, 1); NaN beside the ground or a missing value.")
      .def("set_commands",
           [](rille::Model& m, const std::string& drive, const nb::ndarray<double, nb::ndim<1>, nb::c_contig, nb::device::cpu>& times,
              const nb::ndarray<double, nb::ndim<1>, nb::c_contig, nb::device::cpu>& values) {
             const int index = rille::find_named(m.rover.drives, drive, "the commands are for drive");
             if (times.shape(0) != values.shape(0))
               throw rille::InputRefused(fmt::format("the commands of drive '{}' have {} times and {} values", drive, times.shape(0), values.shape(0)));
             auto& commands = m.scenario.commands;
             std::erase_if(commands, [&](const rille::Command& c) { return c.drive == index; });
             for (std::size_t k = 0; k < times.shape(0); ++k) {
               if (!std::isfinite(times(k)) || !std::isfinite(values(k)))
                 throw rille::InputRefused(fmt::format("command {} of drive '{}' is not finite", k, drive));
               commands.push_back({index, times(k), values(k)});
             }
             std::stable_sort(commands.begin(), commands.end(), [](const auto& a, const auto& b) { return a.time < b.time; });
           },
           "drive"_a, "times"_a, "values"_a,
           "Replace a drive's commands: each value [rad/s, rad or N m] holds from its time [s] on until the next; times may be negative.")
      .def("set_start",
           [](rille::Model& m, double x, double y, double heading) {
             for (const double value : {x, y, heading})
               if (!std::isfinite(value)) throw rille::InputRefused("x, y or heading of the start is not finite");
             m.scenario.start_position.x() = x;
             m.scenario.start_position.y() = y;
             m.scenario.start_rotation = Eigen::AngleAxisd(heading, Eigen::Vector3d::UnitZ());
           },
           "x"_a, "y"_a, "heading"_a, "Start elsewhere: position [m] and heading [rad] of the root in W; height and tilt stay as they are or come from the ground.")
      .def_prop_ro("step", [](const rille::Model& m) { return m.scenario.step; }, "Time step [s].")
      .def_prop_ro("duration", [](const rille::Model& m) { return m.scenario.duration; }, "Duration of the scenario [s].")
      .def_prop_ro("drive_names", [](const rille::Model& m) { return names(m.rover.drives); }, "Order of drives.")
      .def_prop_ro("drives", [](const rille::Model& m) { return drives(m.rover); }, "(drive, joint, mode: speed, torque or position) of every drive.")
      .def_prop_ro("ratios", [](const rille::Model& m) { return ratios(m.rover); },
                   "(joint a, joint b, ratio) of every differential and gear: position of b = ratio times that of a.")
      .def_prop_ro("wheel_joints", [](const rille::Model& m) {
             std::vector<std::pair<std::string, std::string>> found;
             for (const auto& wheel : m.rover.wheels) found.emplace_back(wheel.name, m.rover.joints[static_cast<std::size_t>(wheel.joint)].name);
             return found;
           }, "(wheel, joint that it turns about) of every wheel.")
      .def_prop_ro("root", [](const rille::Model& m) {
             const int root = free_root(m.rover);
             return root < 0 ? std::string() : m.rover.bodies[static_cast<std::size_t>(root)].name;
           }, "Name of the body that no joint carries; '' where the world holds the mechanism.")
      .def_prop_ro("placed_on_terrain", [](const rille::Model& m) { return m.scenario.placement == rille::Placement::on_terrain; },
                   "Whether the scenario sets the root on the ground.")
      .def_prop_ro("has_ground", [](const rille::Model& m) { return m.terrain.has_value(); }, "Whether the scenario has a terrain.")
      .def_prop_ro("settle_time", [](const rille::Model& m) { return m.scenario.settle_time; }, "Longest time to come to rest [s].");

  nb::class_<Simulation>(module, "Simulation",
                         "One run in memory.\n\n"
                         "Simulation(path, scenario=None, step=None): reads model and scenario (by name; None: the only one)\n"
                         "from a database; step [s] overrides the scenario's. Raises rille.model.InputRefused.")
      .def("__init__",
           [](Simulation* self, const std::string& path, const std::optional<std::string>& scenario,
              const std::optional<double>& step) { new (self) Simulation(load(path, scenario, step)); },
           "path"_a, "scenario"_a = nb::none(), "step"_a = nb::none())
      .def("__init__", [](Simulation* self, const rille::Model& model) { new (self) Simulation(model); }, "model"_a)
      .def_prop_ro("facts", [](const Simulation& s) { return facts(s.model()); }, "As of a Model, with what effects change in masses and centres of mass.")
      .def_prop_ro("gravity", [](const Simulation& s) { return triple(s.model().scenario.gravity); }, "Gravity in W [m/s^2], effects included.")
      .def("save", [](Simulation& s) { const std::string state = s.save(); return nb::bytes(state.data(), state.size()); },
           "The complete state as bytes: a simulation of the same model that restores them goes on bit by bit as this one.")
      .def("restore", [](Simulation& s, const nb::bytes& state) { s.restore_or_stay(std::string(state.c_str(), state.size())); }, "state"_a,
           "Take over a saved state. Raises rille.model.InputRefused for a state of another model.")
      .def("motion", [](Simulation& s) { auto row = rille::motion_row(s); const std::size_t n = row.size(); return array(std::move(row), 1, n); },
           "Shape (1, 8 + n_q + n_v): time, root position and quaternion x y z w of its principal frame, joint positions, velocities.")
      .def("start_at", [](Simulation& s, const nb::ndarray<double, nb::ndim<1>, nb::c_contig, nb::device::cpu>& row) {
             const rille::MechanismState motion = rille::motion_from_row(s, row.data(), row.shape(0));
             s.start_at(row(0), motion);
           }, "motion"_a, "Go on from a row of motion(), with everything that is not motion at rest.")
      .def("state", [](Simulation& s) { auto row = state_row(s); const std::size_t n = row.size(); return array(std::move(row), 1, n); },
           "Shape (1, 14 + 2 n): time, pose of the root's body frame (position [m], quaternion w x y z), its velocity [m/s] and angular\n"
           "velocity [rad/s] in W, then positions and velocities of the joints named by state_joints. A model that is held by the world has no\n"
           "root: zeros and the unit quaternion.")
      .def("motions",
           [](Simulation& s, const nb::ndarray<double, nb::ndim<2>, nb::c_contig, nb::device::cpu>& states) {
             const rille::MechanismState before = s.mechanism().state();
             std::vector<double> rows;
             const std::size_t n = states.shape(0);
             for (std::size_t k = 0; k < n; ++k) {
               place_at_row(s, states.data() + k * states.shape(1), states.shape(1));
               auto row = rille::motion_row(s);
               row[0] = states(k, 0);
               rows.insert(rows.end(), row.begin(), row.end());
             }
             s.mechanism().set_state(before);
             s.mechanism().update_kinematics();
             const std::size_t width = n == 0 ? 0 : rows.size() / n;
             return array(std::move(rows), n, width);
           },
           "states"_a, "Rows of motion() (m, 8 + n_q + n_v) for rows of state() (m, 14 + 2 n); the simulation stays where it is.")
      .def_prop_ro("state_joints", [](const Simulation& s) {
             std::vector<std::string> result;
             for (const int j : single_joints(s)) result.push_back(s.model().rover.joints[static_cast<std::size_t>(j)].name);
             return result;
           }, "Names of the joints in a row of state(): hinges and prismatic joints in their order.")
      .def("command", [](Simulation& s, const std::string& drive, double value) {
             s.command(rille::find_named(s.model().rover.drives, drive, "the command is for drive"), value);
           }, "drive"_a, "value"_a,
           "Give a drive a set value from the next step on [rad/s, rad or N m], later by its command_delay; at t = 0 from the end of the first step on.")
      .def("set_values", &Simulation::set_values, "Set values of the drives as of the next step, in the order of drive_names [rad/s, rad or N m].")
      .def("change", [](Simulation& s, const std::string& quantity, const std::string& target, const std::vector<double>& values) {
             s.change({0, quantity, target, values});
           }, "quantity"_a, "target"_a, "values"_a,
           "Put a joint (joint.position, joint.velocity) or the root (part.position, part.orientation w x y z, part.linear_velocity,\n"
           "part.angular_velocity, in W) elsewhere now [SI]. Raises rille.model.InputRefused.")
      .def("read", [](const Simulation& s, const std::string& quantity, const std::string& target) {
             rille::Quantity reader(s.model().rover, quantity, target, false, "the question");
             return s.read(reader);
           }, "quantity"_a, "target"_a, "Numbers of a quantity as of now [SI], in W. Raises rille.model.InputRefused.")
      .def("view", &view, "origin"_a,
           "Everything that a picture needs, float32: of each body x y z [m, less origin] and quaternion w x y z; of each joint of one freedom\n"
           "position, velocity, effort, work; of each wheel centre x y z and ground height [m, less origin], slip ratio, slip angle, sinkage,\n"
           "normal load, drawbar pull, side force, drive torque.")
      .def("sample", [](Simulation& s, long long n_steps, long long every, const rille::ChannelNames& channels, bool from_start) {
             if (n_steps < 1 || every < 1) throw rille::InputRefused("sample needs n_steps and every of at least 1");
             auto read = rille::channel_readers(s.model().rover, channels);
             const std::size_t n_samples = static_cast<std::size_t>(n_steps / every) + (from_start ? 1 : 0);
             std::vector<double> values(n_samples * channels.size());
             {
               nb::gil_scoped_release release;
               rille::sample(s, read, n_steps, every, from_start, values.data());
             }
             return array(std::move(values), n_samples, channels.size());
           }, "n_steps"_a, "every"_a, "channels"_a, "from_start"_a = false,
           "Advance n_steps and read channels, (quantity, target, component), after every so many: shape (n_steps // every, n_channels);\n"
           "from_start: one row more, before the first step.")
      .def("inverse_dynamics", [](Simulation& s, const nb::ndarray<double, nb::ndim<1>, nb::c_contig, nb::device::cpu>& acceleration) {
             const Eigen::Map<const Eigen::VectorXd> a(acceleration.data(), static_cast<Eigen::Index>(acceleration.shape(0)));
             const Eigen::VectorXd effort = s.inverse_dynamics(a);
             return array(std::vector<double>(effort.data(), effort.data() + effort.size()), 1, static_cast<std::size_t>(effort.size()));
           }, "acceleration"_a,
           "Efforts (1, n_v) that would give the accelerations (n_v) in the present state, with the last step's forces of soil and contacts.")
      .def("reactions", [](const Simulation& s) {
             std::vector<double> v;
             const auto snapshot = s.snapshot();
             for (const auto& r : snapshot.reactions) v.insert(v.end(), {r.force.x(), r.force.y(), r.force.z(), r.torque.x(), r.torque.y(), r.torque.z()});
             return array(std::move(v), snapshot.reactions.size(), 6);
           }, "Shape (n_joints, 6): force [N] and torque [N m] of the carrier on the carried body about the joint's point, in W.")
      .def("energy_balance", [](const Simulation& s) {
             const rille::EnergyState e = s.snapshot().energy;
             nb::dict d;
             d["kinetic"] = e.kinetic; d["potential"] = e.potential; d["drive_work"] = e.drive_work; d["soil_loss"] = e.soil_loss;
             d["joint_loss"] = e.joint_loss; d["contact_loss"] = e.contact_loss; d["external_work"] = e.external_work; d["residual"] = e.residual;
             return d;
           }, "Energies since t = 0 [J], as in table energy_state.")
      .def("closure_error", &Simulation::largest_closure_error, "Largest distance [m] of points that a loop_closure holds together.")
      .def("events", [](Simulation& s) {
             nb::list list;
             for (const auto& e : s.take_events()) list.append(nb::make_tuple(e.time, e.kind, e.subject, e.message));
             return list;
           }, "Events since the last call: (time [s], kind, subject, sentence).")
      .def_prop_ro("n_v", [](Simulation& s) { return s.mechanism().dofs(); }, "Length of the generalised velocity.")
      .def("settle", [](Simulation& s) { return std::string(word(s.settle())); }, nb::call_guard<nb::gil_scoped_release>(),
           "Come to rest with drives held, for at most the scenario's settle_time. Returns the outcome.")
      .def("step",
           [](Simulation& s, long long count) {
             rille::Outcome outcome = s.outcome();
             for (long long k = 0; k < count && outcome == rille::Outcome::running; ++k) outcome = s.step(k + 1 == count);
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

  using rille::RecordedRun;
  const auto never = [] { return false; };
  nb::class_<RecordedRun>(module, "Run",
                          "A scenario of a database, simulated as far as it is told, its results written into the same database while it runs.\n\n"
                          "Run(path, scenario=None, step=None, duration=None, resume=False, endless=False, saved=None, checkpoint=5.0): resume goes\n"
                          "on with the scenario's run that was interrupted; endless: until it is ended, then the scenario's duration is what it took;\n"
                          "saved: name of a state that it goes on from. Raises rille.model.InputRefused.")
      .def("__init__",
           [](RecordedRun* self, const std::string& path, const std::optional<std::string>& scenario, const std::optional<double>& step,
              const std::optional<double>& duration, bool resume, bool endless, const std::optional<std::string>& saved, double checkpoint) {
             rille::require_double_precision();
             rille::RunOptions options{.database = path, .scenario = scenario, .step = step, .duration = duration, .from = saved,
                                       .checkpoint = checkpoint, .resume = resume, .endless = endless};
             new (self) RecordedRun(options);
           },
           "path"_a, "scenario"_a = nb::none(), "step"_a = nb::none(), "duration"_a = nb::none(), "resume"_a = false, "endless"_a = false,
           "saved"_a = nb::none(), "checkpoint"_a = 5.0)
      .def("begin", [never](RecordedRun& r) { return std::string(word(r.begin(never))); }, nb::call_guard<nb::gil_scoped_release>(),
           "Come to rest and record t = 0. Returns 'running', or the outcome that ended it.")
      .def("advance", [never](RecordedRun& r, long long count, bool to_event) { return std::string(word(r.advance(count, never, to_event))); },
           "count"_a, "to_event"_a = false, nb::call_guard<nb::gil_scoped_release>(),
           "At most count steps, or until something happens. Returns 'running', 'done' at the end of the scenario, or the outcome of physics.")
      .def("finish",
           [](RecordedRun& r, const std::string& outcome, const std::string& message) {
             for (const rille::Outcome known : {rille::Outcome::done, rille::Outcome::stopped, rille::Outcome::interrupted, rille::Outcome::left_terrain,
                                                rille::Outcome::wheel_buried, rille::Outcome::diverged})
               if (outcome == word(known)) return r.finish(known, message);
             throw rille::InputRefused(fmt::format("a run cannot end as '{}'", outcome));
           },
           "outcome"_a = "done", "message"_a = "", "Write what remains; an interrupted run can be resumed. Nothing follows.")
      .def("command", [](RecordedRun& r, const std::string& drive, double value) {
             r.command(rille::find_named(r.simulation().model().rover.drives, drive, "the command is for drive"), value);
           }, "drive"_a, "value"_a, nb::call_guard<nb::gil_scoped_release>(), "As of Simulation, written into the scenario.")
      .def("change", [](RecordedRun& r, const std::string& quantity, const std::string& target, const std::vector<double>& values) {
             r.change({0, quantity, target, values});
           }, "quantity"_a, "target"_a, "values"_a, nb::call_guard<nb::gil_scoped_release>(), "As of Simulation, written into the scenario.")
      .def("log", [](RecordedRun& r, const std::string& received, const std::string& sender, const std::optional<std::int64_t>& sequence,
                     const std::string& request, const std::string& refused) { r.log({received, sender, sequence, request, refused}); },
           "received"_a, "sender"_a, "sequence"_a, "request"_a, "refused"_a = "", nb::call_guard<nb::gil_scoped_release>(), "A line of table command_log.")
      .def("flush", &RecordedRun::flush, nb::call_guard<nb::gil_scoped_release>(),
           "Write what is not written yet, so that others can write into the database while nothing goes on.")
      .def("save", &RecordedRun::save, "name"_a, nb::call_guard<nb::gil_scoped_release>(), "Keep the present state under a name; Run(saved=name) goes on from it.")
      .def("events", [](RecordedRun& r) {
             nb::list list;
             for (const auto& e : r.tell()) list.append(nb::make_tuple(e.time, e.kind, e.subject, e.message));
             return list;
           }, "Events since the last call: (time [s], kind, subject, sentence).")
      .def_prop_ro("simulation", [](RecordedRun& r) -> Simulation& { return r.simulation(); }, nb::rv_policy::reference_internal,
                   "The simulation, to read from; steer the run, not it.")
      .def_prop_ro("id", &RecordedRun::id, "Key of the run.")
      .def_prop_ro("message", [](const RecordedRun& r) { return r.message(); }, "The outcome in a sentence.")
      .def_prop_ro("steps_taken", &RecordedRun::steps_taken, "Steps that were simulated by this object.")
      .def_prop_ro("duration", &RecordedRun::duration, "Duration of the scenario [s].");
}
