#include "tests/bench/bullet_peer.h"

#include <BulletCollision/BroadphaseCollision/btDbvtBroadphase.h>
#include <BulletSoftBody/btDeformableBodySolver.h>
#include <BulletSoftBody/btDeformableGravityForce.h>
#include <BulletSoftBody/btDeformableMultiBodyConstraintSolver.h>
#include <BulletSoftBody/btDeformableMultiBodyDynamicsWorld.h>
#include <BulletSoftBody/btDeformableNeoHookeanForce.h>
#include <BulletSoftBody/btSoftBodyRigidBodyCollisionConfiguration.h>

#include <algorithm>
#include <memory>
#include <numeric>
#include <set>
#include <vector>

namespace {

btVector3 vector_at(const double* points, int node) {
  return {btScalar(points[3 * node]), btScalar(points[3 * node + 1]), btScalar(points[3 * node + 2])};
}

class BulletWorld {
 public:
  explicit BulletWorld(const BulletScene& scene)
      : dispatcher_(&configuration_),
        world_(&dispatcher_, &broadphase_, (constraints_.setDeformableSolver(&solver_), &constraints_), &configuration_,
               &solver_),
        gravity_(btVector3(0, btScalar(scene.gravity), 0)),
        // The constants of the paper's energy, which Bullet takes without turning Lamé's into them (Smith, de Goes, Kim
        // 2018, section 3.4). No damping: the default is heavy.
        elasticity_(btScalar(scene.mu * 4 / 3), btScalar(scene.lambda + scene.mu * 5 / 6), 0) {
    world_.setImplicit(scene.implicit != 0);
    world_.setLineSearch(false);
    world_.setUseProjection(true);  // without it Bullet 3.24 applies no gravity
    world_.setGravity(btVector3(0, btScalar(scene.gravity), 0));
    world_.getWorldInfo().m_gravity = btVector3(0, btScalar(scene.gravity), 0);
    order_nodes(scene);
    make_body(scene);
    world_.addSoftBody(body_.get());
    world_.addForce(body_.get(), &gravity_);
    world_.addForce(body_.get(), &elasticity_);
  }
  ~BulletWorld() { world_.removeSoftBody(body_.get()); }

  void step(double dt) { world_.stepSimulation(btScalar(dt), 0); }

  void read(double* x, double* v) const {
    for (std::size_t k = 0; k < order_.size(); ++k) {
      const btSoftBody::Node& node = body_->m_nodes[static_cast<int>(k)];
      for (int i = 0; i < 3; ++i) {
        x[3 * order_[k] + i] = node.m_x[i];
        v[3 * order_[k] + i] = node.m_v[i];
      }
    }
  }

 private:
  /// Held nodes last: Bullet's implicit forces are counted along the free ones alone and would land on their neighbours.
  void order_nodes(const BulletScene& scene) {
    order_.resize(static_cast<std::size_t>(scene.nodes));
    std::iota(order_.begin(), order_.end(), 0);
    std::stable_partition(order_.begin(), order_.end(), [&](int node) { return scene.held[node] == 0; });
  }

  void make_body(const BulletScene& scene) {
    std::vector<btVector3> places;
    std::vector<btScalar> masses;
    std::vector<int> place_of(order_.size());
    for (std::size_t k = 0; k < order_.size(); ++k) {
      places.push_back(vector_at(scene.rest, order_[k]));
      masses.push_back(scene.held[order_[k]] != 0 ? btScalar(0) : btScalar(scene.mass[order_[k]]));
      place_of[static_cast<std::size_t>(order_[k])] = static_cast<int>(k);
    }
    body_ = std::make_unique<btSoftBody>(&world_.getWorldInfo(), scene.nodes, places.data(), masses.data());
    std::set<std::pair<int, int>> edges;
    for (int t = 0; t < scene.tets; ++t) {
      int corner[4];
      for (int k = 0; k < 4; ++k) corner[k] = place_of[static_cast<std::size_t>(scene.tet[4 * t + k])];
      body_->appendTetra(corner[0], corner[1], corner[2], corner[3]);
      for (int a = 0; a < 4; ++a) {
        for (int b = a + 1; b < 4; ++b) edges.insert(std::minmax(corner[a], corner[b]));
      }
    }
    for (const auto& [low, high] : edges) body_->appendLink(low, high);  // without links the tree of nodes is never done
    body_->initializeDmInverse();
    body_->m_tetraScratches.resize(body_->m_tetras.size());
    body_->m_tetraScratchesTn.resize(body_->m_tetras.size());
    body_->m_cfg.collisions = 0;
    body_->m_cfg.kDP = 0;
    body_->m_cfg.kDG = 0;
    body_->m_cfg.drag = 0;
    body_->m_sleepingThreshold = 0;
    body_->setActivationState(DISABLE_DEACTIVATION);
    for (std::size_t k = 0; k < order_.size(); ++k) {
      btSoftBody::Node& node = body_->m_nodes[static_cast<int>(k)];
      node.m_x = node.m_q = vector_at(scene.x, order_[k]);
      node.m_v = node.m_vn = vector_at(scene.v, order_[k]);
    }
  }

  btSoftBodyRigidBodyCollisionConfiguration configuration_;
  btCollisionDispatcher dispatcher_;
  btDbvtBroadphase broadphase_;
  btDeformableBodySolver solver_;
  btDeformableMultiBodyConstraintSolver constraints_;
  btDeformableMultiBodyDynamicsWorld world_;
  btDeformableGravityForce gravity_;
  btDeformableNeoHookeanForce elasticity_;
  std::unique_ptr<btSoftBody> body_;
  std::vector<int> order_;  // of the scene's nodes in Bullet
};

}  // namespace

void* bullet_make(const BulletScene* scene) { return new BulletWorld(*scene); }
void bullet_step(void* world, double dt) { static_cast<BulletWorld*>(world)->step(dt); }
void bullet_read(const void* world, double* x, double* v) { static_cast<const BulletWorld*>(world)->read(x, v); }
void bullet_destroy(void* world) { delete static_cast<BulletWorld*>(world); }
