#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <functional>

namespace hydrostat::io {

/// Where points lie, frame by frame; frame f is on at f / rate_hz.
struct PointCourse {
  Eigen::Index points = 0, frames = 0;
  double rate_hz = 60;
  std::function<Eigen::Matrix3Xd(Eigen::Index)> at;  // [m] 3 x points, of a frame
};

/// Writes a PC2 point cache: little-endian, one sample a frame, from frame 0 on. Numbers are float32, and neither format
/// holds normals. Throws Error when the file cannot be written.
/// Source: Blender, MOD_meshcache_pc2.c (PC2Head).
void write_pc2(const std::filesystem::path& file, const PointCourse& course);

/// Writes an MDD point cache: big-endian, each frame with its time [s].
/// Source: Blender, MOD_meshcache_mdd.c (MDDHead).
void write_mdd(const std::filesystem::path& file, const PointCourse& course);

}  // namespace hydrostat::io
