#include "world/collision.hpp"

#include <BulletCollision/BroadphaseCollision/btDbvt.h>
#include <btBulletCollisionCommon.h>

#include <algorithm>

#include "world/bullet.hpp"

namespace rille {
namespace {

constexpr int kPool = 16;  // manifolds and algorithms held ready; Bullet allocates more by itself

std::unique_ptr<btCollisionShape> make_shape(const Shape& shape) {
  // Bullet rounds boxes and cylinders inwards by the margin and blows hulls up by it: a small one keeps edges where they are.
  constexpr double kMargin = 1e-3;  // [m]
  std::unique_ptr<btCollisionShape> made;
  switch (shape.kind) {
    case ShapeKind::sphere: return std::make_unique<btSphereShape>(shape.size.x());
    case ShapeKind::box: made = std::make_unique<btBoxShape>(bt(0.5 * shape.size)); break;
    case ShapeKind::cylinder:
      made = std::make_unique<btCylinderShapeZ>(btVector3(shape.size.x(), shape.size.x(), 0.5 * shape.size.z()));
      break;
    case ShapeKind::hull: {
      auto hull = std::make_unique<btConvexHullShape>();
      for (const Eigen::Vector3d& vertex : shape.vertices) hull->addPoint(bt(vertex), false);
      hull->recalcLocalAabb();
      made = std::move(hull);
      break;
    }
  }
  made->setMargin(std::min(kMargin, 0.1 * (shape.kind == ShapeKind::hull ? 1.0 : shape.size.x())));
  return made;
}

btTransform transform(const Eigen::Vector3d& center, const Eigen::Quaterniond& q) {
  return btTransform(bt(q), bt(center));
}

struct Solid {
  std::unique_ptr<btCollisionShape> shape;
  std::unique_ptr<btCollisionObject> object;

  explicit Solid(const Shape& from) : shape(make_shape(from)), object(std::make_unique<btCollisionObject>()) {
    object->setCollisionShape(shape.get());
    object->setWorldTransform(transform(from.center, from.rotation));
  }
};

class Collect final : public btCollisionWorld::ContactResultCallback {
 public:
  Collect(int obstacle, const btCollisionObject* solid, double reach, std::vector<Touch>& touches)
      : obstacle_(obstacle), solid_(solid), touches_(touches) {
    m_closestDistanceThreshold = reach;
  }
  btScalar addSingleResult(btManifoldPoint& point, const btCollisionObjectWrapper* first, int, int, const btCollisionObjectWrapper*, int,
                           int) override {
    const bool obstacle_first = first->getCollisionObject() == solid_;
    Touch touch;
    touch.obstacle = obstacle_;
    touch.point = eigen(obstacle_first ? point.getPositionWorldOnA() : point.getPositionWorldOnB());
    touch.normal = (obstacle_first ? -1.0 : 1.0) * eigen(point.m_normalWorldOnB);
    touch.gap = point.getDistance();
    if (touch.normal.allFinite() && touch.normal.squaredNorm() > 0.5) touches_.push_back(touch);
    return 0;
  }

 private:
  int obstacle_;
  const btCollisionObject* solid_;
  std::vector<Touch>& touches_;
};

struct Gather final : btDbvt::ICollide {
  std::vector<int> found;
  void Process(const btDbvtNode* leaf) override { found.push_back(leaf->dataAsInt); }
};

// One pair of solids is looked at at a time. Bullet's own pools, 6.4 MB of manifolds alone, would be most of the time of making a simulation.
btDefaultCollisionConstructionInfo small_pools() {
  btDefaultCollisionConstructionInfo info;
  info.m_defaultMaxPersistentManifoldPoolSize = kPool;
  info.m_defaultMaxCollisionAlgorithmPoolSize = kPool;
  return info;
}

}  // namespace

struct Collision::Impl {
  btDefaultCollisionConfiguration configuration{small_pools()};
  btCollisionDispatcher dispatcher{&configuration};
  btDbvtBroadphase broadphase;
  btCollisionWorld world{&dispatcher, &broadphase, &configuration};
  std::vector<Solid> obstacles;
  std::vector<Solid> movers;
  btDbvt tree;  // boxes of the obstacles, which do not move
};

Collision::Collision(const std::vector<Obstacle>& obstacles) : impl_(std::make_unique<Impl>()) {
  // A resting face has several points, not one: let the narrow phase tilt a little and look again.
  impl_->configuration.setConvexConvexMultipointIterations(3, 3);
  for (const Obstacle& obstacle : obstacles) {
    Solid& solid = impl_->obstacles.emplace_back(obstacle.shape);
    btVector3 low, high;
    solid.shape->getAabb(solid.object->getWorldTransform(), low, high);
    const btDbvtVolume volume = btDbvtVolume::FromMM(low, high);
    btDbvtNode* leaf = impl_->tree.insert(volume, nullptr);
    leaf->dataAsInt = static_cast<int>(impl_->obstacles.size()) - 1;
  }
}

Collision::~Collision() = default;
Collision::Collision(Collision&&) noexcept = default;
Collision& Collision::operator=(Collision&&) noexcept = default;

bool Collision::empty() const { return impl_->obstacles.empty(); }

int Collision::add_mover(const Shape& shape) {
  impl_->movers.emplace_back(shape);
  return static_cast<int>(impl_->movers.size()) - 1;
}

void Collision::find(int mover, const Eigen::Vector3d& center, const Eigen::Quaterniond& rotation, double reach,
                     std::vector<Touch>& touches) const {
  Impl& m = *impl_;
  Solid& solid = m.movers[static_cast<std::size_t>(mover)];
  const btTransform pose = transform(center, rotation);
  btVector3 low, high;
  solid.shape->getAabb(pose, low, high);
  const btVector3 margin(reach, reach, reach);
  Gather gather;
  m.tree.collideTV(m.tree.m_root, btDbvtVolume::FromMM(low - margin, high + margin), gather);
  if (gather.found.empty()) return;
  std::sort(gather.found.begin(), gather.found.end());  // the order of the tree is not ours
  solid.object->setWorldTransform(pose);
  for (const int obstacle : gather.found) {
    Solid& other = m.obstacles[static_cast<std::size_t>(obstacle)];
    Collect collect(obstacle, other.object.get(), reach, touches);
    m.world.contactPairTest(solid.object.get(), other.object.get(), collect);
  }
}

}  // namespace rille
