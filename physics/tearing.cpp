#include "physics/tearing.h"

#include <algorithm>

#include "physics/springs_alone.h"

namespace hydrostat::physics {
namespace {

template <int Dim>
SplitMesh<Dim> all_apart(const FractureOf<Dim>& fracture) {
  return split_mesh(fracture.mesh, fracture.faces, std::vector<char>(fracture.faces.size(), 1));
}

/// The elements of the apart mesh that touch a seam; their nodes, in ascending order, are numbered anew.
template <int Dim>
ElementMesh<Dim> rim_of(const FractureOf<Dim>& fracture, const ElementMesh<Dim>& apart, std::vector<int>& nodes) {
  std::vector<char> is_at_seam(static_cast<std::size_t>(apart.rest.cols()), 0);
  for (const SeamFace& face : fracture.faces) {
    for (std::size_t side = 0; side < 2; ++side) {
      for (std::size_t k = 0; k < static_cast<std::size_t>(face.corner_count); ++k) {
        is_at_seam[static_cast<std::size_t>(apart.nodes(face.corners[side][k], face.elements[side]))] = 1;
      }
    }
  }
  std::vector<int> elements;
  for (int e = 0; e < apart.nodes.cols(); ++e) {
    const auto touches = [&](int node) { return is_at_seam[static_cast<std::size_t>(node)] != 0; };
    if (std::any_of(apart.nodes.col(e).begin(), apart.nodes.col(e).end(), touches)) elements.push_back(e);
  }
  ElementMesh<Dim> rim{{}, apart.nodes(Eigen::all, elements), {}, apart.fill(elements)};
  nodes.assign(rim.nodes.reshaped().begin(), rim.nodes.reshaped().end());
  std::sort(nodes.begin(), nodes.end());
  nodes.erase(std::unique(nodes.begin(), nodes.end()), nodes.end());
  for (int& node : rim.nodes.reshaped()) node = static_cast<int>(std::lower_bound(nodes.begin(), nodes.end(), node) - nodes.begin());
  rim.rest = apart.rest(Eigen::all, nodes);
  for (const int e : elements) rim.materials.push_back(apart.materials[apart.materials.size() == 1 ? 0 : static_cast<std::size_t>(e)]);
  return rim;
}

}  // namespace

template <int Dim>
SeamWatch<Dim>::SeamWatch(const FractureOf<Dim>& fracture, const BodyOf<Dim>& whole, const SplitMesh<Dim>& apart, bool springs) {
  SplitMesh<Dim> rim{rim_of(fracture, apart.mesh, nodes_), {}};
  rim.origin = apart.origin(nodes_);
  rim_ = split_body(fracture, whole, rim);
  whole_edges_ = whole_edges(whole, rim_, rim.origin);
  if (springs) rim_ = physics::springs_alone(rim_);
  forces_.emplace(rim_);
  const auto in_rim = [&](int corner, int element) {
    const int node = apart.mesh.nodes(corner, element);
    return static_cast<int>(std::lower_bound(nodes_.begin(), nodes_.end(), node) - nodes_.begin());
  };
  const bool of_boxes = apart.mesh.nodes.rows() > Dim + 1;
  behind_.resize(fracture.seams.size());
  for (const SeamFace& from : fracture.faces) {
    Face face{from.seam, from.corner_count};
    for (std::size_t side = 0; side < 2; ++side) {
      const int element = from.elements[side];
      const auto place = [&](int corner) { return apart.mesh.rest.col(apart.mesh.nodes(corner, element)); };
      face.span[side][0] = in_rim(0, element);
      for (int d = 0; d < Dim; ++d) {
        const int corner = of_boxes ? 1 << d : d + 1;
        face.span[side][static_cast<std::size_t>(d) + 1] = in_rim(corner, element);
        face.ahead[side][d] = fracture.seams[static_cast<std::size_t>(from.seam)].normal.dot(place(corner) - place(0));
      }
    }
    std::vector<int>& behind = behind_[static_cast<std::size_t>(face.seam)];
    for (std::size_t k = 0; k < static_cast<std::size_t>(face.count); ++k) {
      face.behind[k] = in_rim(from.corners[0][k], from.elements[0]);
      face.front[k] = in_rim(from.corners[1][k], from.elements[1]);
      if (face.behind[k] != face.front[k]) behind.push_back(face.behind[k]);
    }
    faces_.push_back(face);
  }
  for (std::vector<int>& nodes : behind_) {
    std::sort(nodes.begin(), nodes.end());
    nodes.erase(std::unique(nodes.begin(), nodes.end()), nodes.end());
  }
  x_ = force_ = sum_ = pull_ = area_ = PointsOf<Dim>::Zero(Dim, rim_.node_count());
  mass_.resize(rim_.node_count());
  activation_ = Eigen::VectorXd::Ones(rim_.edge_count());
  tension_.resize(static_cast<Eigen::Index>(faces_.size()));
  follow(apart.origin);
}

template <int Dim>
void SeamWatch<Dim>::follow(const Eigen::VectorXi& node_now) {
  node_now_.resize(nodes_.size());
  first_.resize(nodes_.size());
  std::vector<int> first_of(static_cast<std::size_t>(node_now.maxCoeff() + 1), -1);
  for (std::size_t i = 0; i < nodes_.size(); ++i) {
    node_now_[i] = node_now[nodes_[i]];
    int& first = first_of[static_cast<std::size_t>(node_now_[i])];
    if (first < 0) first = static_cast<int>(i);
    first_[i] = first;
  }
  mass_.setZero();
  for (std::size_t i = 0; i < nodes_.size(); ++i) mass_[first_[i]] += rim_.mass[static_cast<Eigen::Index>(i)];
}

/// Makes the force of each copy's own elements what holds it to the others that are one node with it.
template <int Dim>
void SeamWatch<Dim>::hold_together() {
  sum_.setZero();
  for (Eigen::Index i = 0; i < force_.cols(); ++i) sum_.col(first_[static_cast<std::size_t>(i)]) += force_.col(i);
  for (Eigen::Index i = 0; i < force_.cols(); ++i) {
    const int first = first_[static_cast<std::size_t>(i)];
    force_.col(i) = rim_.mass[i] / mass_[first] * sum_.col(first) - force_.col(i);
  }
}

/// Of the marked plane, carried along by the elements on both sides: F^-T times that at rest. Zero where one is inside out.
template <int Dim>
VectorOf<Dim> SeamWatch<Dim>::normal_of(const Face& face) const {
  VectorOf<Dim> sum = VectorOf<Dim>::Zero();
  for (std::size_t side = 0; side < 2; ++side) {
    BlockOf<Dim> spans;
    for (std::size_t d = 0; d < Dim; ++d) {
      spans.row(static_cast<Eigen::Index>(d)) = x_.col(face.span[side][d + 1]) - x_.col(face.span[side][0]);
    }
    if (!(spans.determinant() != 0)) return VectorOf<Dim>::Zero();
    sum += (spans.inverse() * face.ahead[side]).normalized();
  }
  return sum.normalized();
}

template <int Dim>
void SeamWatch<Dim>::measure_seam(int seam, const std::vector<char>& is_broken) {
  pull_.setZero();
  area_.setZero();
  for (const int i : behind_[static_cast<std::size_t>(seam)]) pull_.col(first_[static_cast<std::size_t>(i)]) += force_.col(i);
  const auto first_behind = [&](const Face& face, std::size_t k) { return first_[static_cast<std::size_t>(face.behind[k])]; };
  for (std::size_t f = 0; f < faces_.size(); ++f) {
    const Face& face = faces_[f];
    if (face.seam != seam || is_broken[f]) continue;
    const VectorOf<Dim> part = area_vector<Dim>(x_, face.behind, face.count) / face.count;
    for (std::size_t k = 0; k < static_cast<std::size_t>(face.count); ++k) {
      if (face.behind[k] != face.front[k]) area_.col(first_behind(face, k)) += part;
    }
  }
  for (std::size_t f = 0; f < faces_.size(); ++f) {
    const Face& face = faces_[f];
    if (face.seam != seam || is_broken[f]) continue;
    VectorOf<Dim> pull = VectorOf<Dim>::Zero(), area = VectorOf<Dim>::Zero();
    for (std::size_t k = 0; k < static_cast<std::size_t>(face.count); ++k) {
      if (face.behind[k] == face.front[k]) continue;
      pull += pull_.col(first_behind(face, k));
      area += area_.col(first_behind(face, k));
    }
    const VectorOf<Dim> normal = normal_of(face);
    if (area.dot(normal) > 0) tension_[static_cast<Eigen::Index>(f)] = pull.dot(normal) / area.dot(normal);
  }
}

template <int Dim>
const Eigen::VectorXd& SeamWatch<Dim>::tensions(const PointsOf<Dim>& x, const Eigen::VectorXd& activation,
                                                const std::vector<char>& is_broken) {
  tension_.setZero();
  for (std::size_t i = 0; i < nodes_.size(); ++i) x_.col(static_cast<Eigen::Index>(i)) = x.col(node_now_[i]);
  for (Eigen::Index e = 0; e < activation_.size(); ++e) activation_[e] = activation[whole_edges_[e]];
  if (!forces_->set_activation(activation_)) return tension_;
  force_.setZero();
  forces_->add_elastic_forces(x_, force_);
  hold_together();
  for (std::size_t s = 0; s < behind_.size(); ++s) measure_seam(static_cast<int>(s), is_broken);
  return tension_;
}

template <int Dim>
Tearing<Dim>::Tearing(const FractureOf<Dim>& fracture, const BodyOf<Dim>& whole, bool springs_alone)
    : fracture_(fracture),
      whole_(whole),
      is_broken_(fracture.faces.size(), 0),
      now_(split_mesh(fracture.mesh, fracture.faces, is_broken_)),
      apart_(all_apart(fracture)),
      apart_body_(split_body(fracture, whole, apart_)),
      edges_now_(Eigen::VectorXi::LinSpaced(whole.edge_count(), 0, whole.edge_count() - 1)),
      apart_edges_(whole_edges(whole, apart_body_, apart_.origin)),
      watch_(fracture, whole, apart_, springs_alone) {
  number_nodes(whole);
}

template <int Dim>
void Tearing<Dim>::number_nodes(const BodyOf<Dim>& body) {
  node_now_.resize(apart_.origin.size());
  for (Eigen::Index e = 0; e < apart_.mesh.nodes.size(); ++e) {
    node_now_[apart_.mesh.nodes.reshaped()[e]] = now_.mesh.nodes.reshaped()[e];
  }
  mass_share_ = apart_body_.mass.cwiseQuotient(body.mass(node_now_));
}

template <int Dim>
std::vector<int> Tearing<Dim>::break_loaded(const StateOf<Dim>& state, const Eigen::VectorXd& activation) {
  const Eigen::VectorXd& tension = watch_.tensions(state.x, activation, is_broken_);
  std::vector<int> broken;
  for (std::size_t f = 0; f < is_broken_.size(); ++f) {
    const auto seam = static_cast<std::size_t>(fracture_.faces[f].seam);
    if (is_broken_[f] || !(tension[static_cast<Eigen::Index>(f)] > fracture_.seams[seam].strength)) continue;
    broken.resize(fracture_.seams.size(), 0);
    ++broken[seam];
    is_broken_[f] = 1;
  }
  return broken;
}

template <int Dim>
bool Tearing<Dim>::split(SceneOf<Dim>& scene, StateOf<Dim>& state) {
  SplitMesh<Dim> next = split_mesh(fracture_.mesh, fracture_.faces, is_broken_);
  if (next.origin.size() == now_.origin.size()) return false;
  Eigen::VectorXi from(next.origin.size());  // which node of the body until now
  for (Eigen::Index e = 0; e < next.mesh.nodes.size(); ++e) from[next.mesh.nodes.reshaped()[e]] = now_.mesh.nodes.reshaped()[e];
  now_ = std::move(next);
  const std::vector<int> held = std::move(scene.body.held);
  scene.body = split_body(fracture_, whole_, now_);
  scene.body.held = copies_of(held, from);
  touch_with_whole_surface(scene);
  scene.self_contact = fracture_.self_contact;
  state.x = state.x(Eigen::all, from).eval();
  state.v = state.v(Eigen::all, from).eval();
  edges_now_ = whole_edges(whole_, scene.body, now_.origin);
  number_nodes(scene.body);
  watch_.follow(node_now_);
  return true;
}

template class SeamWatch<2>;
template class SeamWatch<3>;
template class Tearing<2>;
template class Tearing<3>;

}  // namespace hydrostat::physics
