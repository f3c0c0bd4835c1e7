#include "world/ruts.hpp"

#include <algorithm>

namespace rille {
namespace {

// Points across a wheel, so that no cell between its edges is missed.
int points_across(double width, double posting) { return std::max(2, static_cast<int>(std::ceil(width / posting)) + 1); }

}  // namespace

bool Ruts::on_map(const Eigen::Vector2d& p) const {
  const double most = 2 * kMostCells * posting_;  // beyond the far edges: a wheel may overhang them
  return p.x() >= x_west_ && p.y() <= y_north_ && p.x() - x_west_ < most && y_north_ - p.y() < most;
}

std::size_t Ruts::cell(double x, double y, Key& key) const {
  const auto row = static_cast<int>(std::lround((y_north_ - y) / posting_));
  const auto column = static_cast<int>(std::lround((x - x_west_) / posting_));
  key = {row / kTile, column / kTile};
  return static_cast<std::size_t>((row % kTile) * kTile + column % kTile);
}

const Ruts::Tile* Ruts::find(const Key& key) const {
  if (last_ != nullptr && key == last_key_) return last_;
  const auto found = tiles_.find(key);
  if (found == tiles_.end()) return nullptr;
  last_key_ = key;
  last_ = &found->second;
  return last_;
}

void Ruts::mark(const Eigen::Vector2d& center, const Eigen::Vector2d& left, double width, double sinkage, double pressure) {
  const int n = points_across(width, posting_);
  for (int k = 0; k < n; ++k) {
    const Eigen::Vector2d p = center + (static_cast<double>(k) / (n - 1) - 0.5) * width * left;
    if (!on_map(p)) continue;
    Key key;
    const std::size_t at = cell(p.x(), p.y(), key);
    Tile* tile = const_cast<Tile*>(find(key));  // tiles_ is ours and not const here
    if (tile == nullptr) {
      tile = &tiles_[key];
      last_key_ = key;
      last_ = tile;
    }
    tile->sinkage[at] = std::max(tile->sinkage[at], static_cast<float>(sinkage));
    tile->pressure[at] = std::max(tile->pressure[at], static_cast<float>(pressure));
  }
}

double Ruts::depth(const Eigen::Vector2d& center, const Eigen::Vector2d& left, double width) const {
  const int n = points_across(width, posting_);
  double sum = 0;
  for (int k = 0; k < n; ++k) {
    const Eigen::Vector2d p = center + (static_cast<double>(k) / (n - 1) - 0.5) * width * left;
    if (!on_map(p)) continue;
    Key key;
    const std::size_t at = cell(p.x(), p.y(), key);
    if (const Tile* tile = find(key)) sum += tile->sinkage[at];
  }
  return sum / n;
}

}  // namespace rille
