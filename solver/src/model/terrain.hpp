// Terrain and soil as read from the database.
#pragma once

#include <Eigen/Core>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "model/rover.hpp"
#include "model/wheel_soil_law.hpp"

namespace rille {

// Parameters of a soil; plain numbers, so that an effect can change a copy of them at every step.
struct Soil {
  double sinkage_exponent = 1;         // [-] n
  double cohesive_modulus = 0;         // [N/m^(n+1)] kc
  double frictional_modulus = 0;       // [N/m^(n+2)] kphi
  double cohesion = 0;                 // [Pa] c
  double friction_angle = 0;           // [rad] phi
  double shear_modulus = 0;            // [m] K
  double lateral_shear_modulus = 0;    // [m] ky
  double peak_angle_offset = 0;        // [-] a0 in theta_m = (a0 + a1 s) theta_f
  double peak_angle_slip = 0;          // [-] a1
  double exit_sinkage_ratio = 0;       // [-] lambda in theta_r = -acos(1 - lambda z/r)
  double damping = 0;                  // [Pa s/m] pressure per speed of penetration
  double unit_weight = 0;              // [N/m^3] density times gravity
  double shear_gain = 1;               // [-] factor of the shear strength (grousers)
  double packed_depth = 0;             // [m] how far the ground is packed already below its undisturbed surface (ruts)
  double packed_stiffness = 0;         // [Pa/m] of packed soil when it is loaded again
  std::optional<double> reece_cohesive_modulus;    // [-] kc', absent: from kc at the wheel's width
  std::optional<double> reece_frictional_modulus;  // [-] kphi', absent: from kphi at the wheel's width
};

// Regular grid of heights; n values bound n-1 cells; row 0 is the northernmost.
struct HeightGrid {
  int n_rows = 0;
  int n_cols = 0;
  double posting_x = 0;         // [m] distance of neighbouring columns
  double posting_y = 0;         // [m] distance of neighbouring rows
  double x_west = 0;            // [m] x of column 0
  double y_north = 0;           // [m] y of row 0
  std::vector<double> heights;  // [m] row by row; NaN = no value

  static constexpr int kBlock = 16;  // cells along a side of a block
  std::vector<double> highest;       // [m] largest height of each block, row by row; empty = not known

  int blocks_across() const { return (n_cols - 2) / kBlock + 1; }
  int blocks_down() const { return (n_rows - 2) / kBlock + 1; }
  void find_highest();
};

// A post on the line between two blocks belongs to both.
inline void HeightGrid::find_highest() {
  highest.assign(static_cast<std::size_t>(blocks_across()) * blocks_down(), -std::numeric_limits<double>::infinity());
  for (int row = 0; row < n_rows; ++row)
    for (int column = 0; column < n_cols; ++column) {
      const double height = heights[static_cast<std::size_t>(row) * n_cols + column];
      for (int i = std::max(row - 1, 0) / kBlock; i <= std::min(row / kBlock, blocks_down() - 1); ++i)
        for (int j = std::max(column - 1, 0) / kBlock; j <= std::min(column / kBlock, blocks_across() - 1); ++j) {
          double& most = highest[static_cast<std::size_t>(i) * blocks_across() + j];
          if (height > most) most = height;
        }
    }
}

struct SoilPatch {
  int soil = 0;                          // index of the soil inside
  std::vector<Eigen::Vector2d> polygon;  // [m] corners, closed by itself
};

// Rigid-rigid or wheel-on-rigid-ground response.
struct RigidPair {
  double friction = 0.5;    // [-] Coulomb
  double restitution = 0;   // [-] normal speed after per before impact
};

struct Obstacle {
  std::string name;
  Shape shape;  // in W
};

struct Terrain {
  std::string name;
  std::shared_ptr<const HeightGrid> grid;  // shared by copies of a model: it is the only large thing
  std::vector<Soil> soils;
  std::vector<std::string> soil_names;
  int base_soil = 0;
  std::vector<SoilPatch> patches;                   // later ones lie on earlier ones
  std::vector<std::vector<WheelSoilLaw>> response;  // [wheel][soil]: law of the pair
  std::vector<std::vector<RigidPair>> rigid_ground; // [wheel, then shape][soil]: friction of hard ground, of hulls on any ground
  std::vector<Obstacle> obstacles;
  std::vector<std::vector<RigidPair>> rigid;        // [wheel, then shape][obstacle]
};

}  // namespace rille
