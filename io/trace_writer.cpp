#include "io/trace_writer.h"

#include <cassert>
#include <string>

#include "io/npy.h"
#include "io/writable.h"
#include "retarget/error.h"

namespace hydrostat::io {
namespace {

namespace fs = std::filesystem;

/// Eigen's columns are NumPy's rows, so that the memory can be written as it lies.
template <typename Derived>
void write_array(const fs::path& path, const std::vector<std::size_t>& shape,
                 const Eigen::PlainObjectBase<Derived>& values) {
  write_npy(path, shape, std::span<const typename Derived::Scalar>(values.data(), static_cast<std::size_t>(values.size())));
}

void write_arrays(const fs::path& folder, const retarget::Trace& trace) {
  const auto steps = static_cast<std::size_t>(trace.count());
  const auto nodes = static_cast<std::size_t>(trace.mass_kg.size());
  const auto edges = static_cast<std::size_t>(trace.edges.cols());
  write_array(folder / "time.npy", {steps}, trace.time_s);
  write_array(folder / "mass.npy", {nodes}, trace.mass_kg);
  write_array(folder / "position.npy", {steps, nodes, 3}, trace.position);
  write_array(folder / "velocity.npy", {steps, nodes, 3}, trace.velocity);
  write_array(folder / "contact_force.npy", {steps, nodes, 3}, trace.contact_force);
  write_array(folder / "effect_force.npy", {steps, nodes, 3}, trace.effect_force);
  write_array(folder / "correction_impulse.npy", {steps, nodes, 3}, trace.correction_impulse);
  write_array(folder / "contact_moment.npy", {steps, 3}, trace.contact_moment);
  write_array(folder / "effect_moment.npy", {steps, 3}, trace.effect_moment);
  write_array(folder / "activation.npy", {steps, edges}, trace.activation);
  write_array(folder / "edges.npy", {edges, 2}, trace.edges);
  write_array(folder / "rest_length.npy", {edges}, trace.rest_length_m);
  write_array(folder / "elements.npy", {static_cast<std::size_t>(trace.elements.cols()), static_cast<std::size_t>(trace.elements.rows())}, trace.elements);
}

void refuse_other_things(const fs::path& folder) {
  if (!fs::exists(folder)) return;
  if (!fs::is_directory(folder))
    throw Error(folder.string(), "--trace", "a file of this name stands there", "Name another folder");
  if (!fs::is_empty(folder) && !fs::exists(folder / "time.npy")) {
    throw Error(folder.string(), "--trace", "the folder holds something that is not a trace",
                "Name an empty or a new folder");
  }
}

/// A name that ends in a slash has an empty last part, beside which nothing can be named.
fs::path place_of(const fs::path& folder) { return folder.has_filename() ? folder : folder.parent_path(); }

}  // namespace

void refuse_trace(const fs::path& folder) {
  const fs::path place = place_of(folder);
  refuse_other_things(place);
  refuse_unwritable(place.parent_path());
}

void write_trace(const fs::path& folder, const retarget::Trace& trace) {
  assert(trace.position.cols() == trace.count() && trace.position.rows() == 3 * trace.mass_kg.size());
  const fs::path place = place_of(folder);
  const fs::path part = place.string() + ".part";
  try {
    refuse_other_things(place);
    fs::remove_all(part);
    fs::create_directories(part);
    write_arrays(part, trace);
    fs::remove_all(place);
    fs::rename(part, place);
  } catch (const fs::filesystem_error& failure) {
    std::error_code ignored;
    fs::remove_all(part, ignored);
    throw Error(place.string(), "--trace", "the folder cannot be written: " + failure.code().message(),
                "Name a folder that you may write to");
  } catch (const Error&) {
    std::error_code ignored;
    fs::remove_all(part, ignored);
    throw;
  }
}

}  // namespace hydrostat::io
