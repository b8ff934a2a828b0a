#pragma once

#include <gtest/gtest.h>
#include <tiny_gltf.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cstring>
#include <filesystem>
#include <string>
#include <vector>

/// Files of io/gltf_out.h as engines play them.
namespace hydrostat::io::played_glb {

inline tinygltf::Model load(const std::filesystem::path& path) {
  tinygltf::Model model;
  tinygltf::TinyGLTF loader;
  std::string error, warning;
  EXPECT_TRUE(loader.LoadBinaryFromFile(&model, &error, &warning, path.string())) << error;
  EXPECT_EQ(warning, "");
  return model;
}

template <typename Number>
std::vector<Number> values(const tinygltf::Model& model, int index) {
  const tinygltf::Accessor& accessor = model.accessors.at(static_cast<std::size_t>(index));
  const tinygltf::BufferView& view = model.bufferViews.at(static_cast<std::size_t>(accessor.bufferView));
  const auto components = static_cast<std::size_t>(tinygltf::GetNumComponentsInType(static_cast<uint32_t>(accessor.type)));
  std::vector<Number> result(accessor.count * components);
  std::memcpy(result.data(), model.buffers[0].data.data() + view.byteOffset + accessor.byteOffset,
              result.size() * sizeof(Number));
  return result;
}

/// Linear blend skinning as an engine does it, from what the file says, between key `key` and the next at `share` of the
/// way. Positions [m] of a primitive's vertices.
inline Eigen::Matrix3Xd play(const tinygltf::Model& model, std::size_t key, double share = 0, std::size_t part = 0) {
  const tinygltf::Primitive& primitive = model.meshes[0].primitives[part];
  std::vector<float> positions = values<float>(model, primitive.attributes.at("POSITION"));
  const std::vector<unsigned short> joints = values<unsigned short>(model, primitive.attributes.at("JOINTS_0"));
  const std::vector<float> weights = values<float>(model, primitive.attributes.at("WEIGHTS_0"));
  const std::vector<float> inverse_binds = values<float>(model, model.skins[0].inverseBindMatrices);
  std::vector<Eigen::Affine3d> pose(model.skins[0].joints.size());
  const tinygltf::Animation& animation = model.animations.at(0);
  for (const tinygltf::AnimationChannel& channel : animation.channels) {
    const std::vector<float> keys =
        values<float>(model, animation.samplers[static_cast<std::size_t>(channel.sampler)].output);
    const auto joint = static_cast<std::size_t>(channel.target_node - model.skins[0].joints[0]);
    const std::size_t next = share > 0 ? key + 1 : key;
    if (channel.target_path == "weights") {
      for (std::size_t k = 0, targets = primitive.targets.size(); k < targets; ++k) {
        const auto weight = static_cast<float>((1 - share) * keys[targets * key + k] + share * keys[targets * next + k]);
        const std::vector<float> offsets = values<float>(model, primitive.targets[k].at("POSITION"));
        for (std::size_t i = 0; i < offsets.size(); ++i) positions[i] += weight * offsets[i];
      }
      continue;
    }
    if (channel.target_path == "translation") {
      const Eigen::Vector3d here = Eigen::Map<const Eigen::Vector3f>(&keys[3 * key]).cast<double>();
      const Eigen::Vector3d there = Eigen::Map<const Eigen::Vector3f>(&keys[3 * next]).cast<double>();
      pose[joint].translation() = here + share * (there - here);
    } else {
      const Eigen::Quaterniond here = Eigen::Map<const Eigen::Quaternionf>(&keys[4 * key]).cast<double>();
      const Eigen::Quaterniond there = Eigen::Map<const Eigen::Quaternionf>(&keys[4 * next]).cast<double>();
      pose[joint].linear() = here.slerp(share, there).toRotationMatrix();
    }
  }
  Eigen::Matrix3Xd played = Eigen::Matrix3Xd::Zero(3, static_cast<Eigen::Index>(positions.size() / 3));
  for (std::size_t v = 0; v < positions.size() / 3; ++v) {
    const Eigen::Vector3d bind = Eigen::Map<const Eigen::Vector3f>(&positions[3 * v]).cast<double>();
    for (std::size_t k = 0; k < 4; ++k) {
      const std::size_t joint = joints[4 * v + k];
      const Eigen::Matrix4d inverse_bind = Eigen::Map<const Eigen::Matrix4f>(&inverse_binds[16 * joint]).cast<double>();
      played.col(static_cast<Eigen::Index>(v)) +=
          double{weights[4 * v + k]} * (pose[joint] * (inverse_bind * bind.homogeneous()).head<3>());
    }
  }
  return played;
}

/// The same at a time [s], before the first key and after the last as on these.
inline Eigen::Matrix3Xd play_at(const tinygltf::Model& model, double time_s, std::size_t part = 0) {
  const std::vector<float> times = values<float>(model, model.animations.at(0).samplers.at(0).input);
  const auto after = std::upper_bound(times.begin(), times.end(), time_s);
  if (after == times.begin()) return play(model, 0, 0, part);
  const auto key = static_cast<std::size_t>(after - times.begin()) - 1;
  if (after == times.end()) return play(model, key, 0, part);
  return play(model, key, (time_s - times[key]) / (double{*after} - times[key]), part);
}

}  // namespace hydrostat::io::played_glb
