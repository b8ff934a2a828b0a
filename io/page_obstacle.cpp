#include "io/page_obstacle.h"

#include "io/scene_body.h"

namespace hydrostat::io {
namespace {

constexpr double kSpread = 3;      // of a half space, per L
constexpr double kDepth = 4;       // of 2D obstacles over the body's thickness
constexpr int kRoundCells = 16;    // across a ball
constexpr int kOutlineCells = 24;  // along an outline

template <int Dim>
physics::SimplexMeshOf<Dim> filled(const physics::ObstacleOf<Dim>& obstacle, double length) {
  using Cells = Eigen::Matrix<int, Dim, 1>;
  if (const auto* box = std::get_if<physics::BoxOf<Dim>>(&obstacle.shape)) {
    return physics::mesh_of_box<Dim>(2 * box->half_extents, Cells::Ones());
  }
  if (const auto* ball = std::get_if<physics::Ball>(&obstacle.shape)) return physics::mesh_of_ball<Dim>(2 * ball->radius, kRoundCells);
  if (const auto* mesh = std::get_if<physics::ClosedMeshOf<Dim>>(&obstacle.shape)) {
    return physics::mesh_inside<Dim>(*mesh, (mesh->high() - mesh->low()).maxCoeff() / kOutlineCells);
  }
  // A half space is shown as a slab below its plane.
  physics::VectorOf<Dim> size = physics::VectorOf<Dim>::Constant(kSpread * length);
  size.y() = 0.1 * length;
  physics::SimplexMeshOf<Dim> slab = physics::mesh_of_box<Dim>(size, Cells::Ones());
  slab.nodes.row(1).array() -= size.y() / 2;
  return slab;
}

}  // namespace

template <int Dim>
PageObstacle page_obstacle(const physics::ObstacleOf<Dim>& obstacle, const retarget::Motion& travel, double length) {
  PageObstacle shown;
  shown.travel = travel;
  shown.is_endless = std::holds_alternative<physics::HalfSpace>(obstacle.shape);
  if constexpr (Dim == 3) {
    if (const auto* mesh = std::get_if<physics::ClosedMeshOf<3>>(&obstacle.shape)) {
      shown.vertices = mesh->vertices();
      shown.triangles = mesh->faces();
    }
  }
  if (shown.triangles.cols() == 0) {
    // Its surface is found as a body's is.
    const physics::SimplexMeshOf<Dim> mesh = filled(obstacle, length);
    retarget::ScenarioOf<Dim> as_body;
    as_body.length = kDepth * length;
    as_body.scene.body = physics::make_body<Dim>(mesh.nodes, mesh.simplices, physics::edges_of(mesh),
                                                 Eigen::VectorXd::Ones(mesh.simplices.cols()), {});
    physics::touch_with_whole_surface(as_body.scene);
    const ShownBody body = shown_body(as_body);
    shown.vertices = body.skin.vertices;
    shown.triangles = body.skin.triangles;
  }
  Eigen::Matrix3d turn = Eigen::Matrix3d::Identity();
  turn.topLeftCorner<Dim, Dim>() = obstacle.turn;
  Eigen::Vector3d place = Eigen::Vector3d::Zero();
  place.head<Dim>() = obstacle.place;
  shown.vertices = (turn * shown.vertices).colwise() + place;
  return shown;
}

template PageObstacle page_obstacle<2>(const physics::ObstacleOf<2>&, const retarget::Motion&, double);
template PageObstacle page_obstacle<3>(const physics::ObstacleOf<3>&, const retarget::Motion&, double);

}  // namespace hydrostat::io
