// What wheels leave in the soil: per cell the largest sinkage and the largest normal stress. Kept in tiles that are made when touched, on a
// grid of its own, fine enough for the narrowest wheel.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <map>
#include <utility>
#include <vector>

#include "model/terrain.hpp"

namespace rille {

class Ruts {
 public:
  static constexpr int kTile = 32;              // cells along a side
  static constexpr double kMostCells = 1 << 29;  // along a side of the map

  struct Tile {
    std::vector<float> sinkage = std::vector<float>(kTile * kTile, 0.0F);   // [m]
    std::vector<float> pressure = std::vector<float>(kTile * kTile, 0.0F);  // [Pa]

    template <class Archive>
    void visit(Archive& archive) {
      archive(sinkage, pressure);
    }
  };
  using Key = std::pair<int, int>;  // row and column of a tile, counted from the north-west

  // Four cells across the narrowest wheel, but never so fine that a cell of the map could not be counted.
  Ruts(const HeightGrid& grid, double narrowest_wheel)
      : posting_(std::max({narrowest_wheel / 4, grid.n_cols * grid.posting_x / kMostCells, grid.n_rows * grid.posting_y / kMostCells})),
        x_west_(grid.x_west),
        y_north_(grid.y_north) {}

  // Marks the cells under a line across the wheel's path, from one edge of the wheel to the other.
  void mark(const Eigen::Vector2d& center, const Eigen::Vector2d& left, double width, double sinkage, double pressure);
  // Mean depth [m] along such a line; 0 on untouched soil.
  double depth(const Eigen::Vector2d& center, const Eigen::Vector2d& left, double width) const;

  // Untouched soil again.
  void clear() {
    tiles_.clear();
    last_ = nullptr;
  }

  double posting() const { return posting_; }
  double x_west() const { return x_west_; }
  double y_north() const { return y_north_; }
  const std::map<Key, Tile>& tiles() const { return tiles_; }

  template <class Archive>
  void visit(Archive& archive) {
    std::vector<std::pair<Key, Tile>> list(tiles_.begin(), tiles_.end());
    archive(list);
    if (!archive.reading()) return;
    std::erase_if(list, [](const auto& item) {
      return item.second.sinkage.size() != kTile * kTile || item.second.pressure.size() != kTile * kTile;
    });
    tiles_ = {list.begin(), list.end()};
    last_ = nullptr;
  }

 private:
  bool on_map(const Eigen::Vector2d& p) const;
  std::size_t cell(double x, double y, Key& key) const;
  const Tile* find(const Key& key) const;

  double posting_;           // [m]
  double x_west_, y_north_;  // [m] of cell (0, 0)
  std::map<Key, Tile> tiles_;
  mutable Key last_key_;     // wheels stay in a tile for many steps
  mutable const Tile* last_ = nullptr;
};

}  // namespace rille
