#pragma once

#include <Eigen/Geometry>
#include <map>
#include <optional>
#include <string>
#include <type_traits>
#include <vector>

#include "io/stage_cache.h"

namespace hydrostat::io {

template <typename Value>
concept Whole = std::is_integral_v<Value> || std::is_enum_v<Value>;

/// Saves values in a record or loads them from it, so that a type names its fields once, for both ways:
///   void name_fields(RecordArchive& archive, Track& track) { archive.fields("name", track.name, "rate_hz", track.rate_hz);
///   }
/// Fields of a type within another are named "outer/inner". Loading throws std::out_of_range where a value is missing.
class RecordArchive {
 public:
  static RecordArchive saving_to(Record& record) { return {&record, nullptr}; }
  static RecordArchive loading_from(const Record& record) { return {nullptr, &record}; }

  bool is_loading() const { return from_ != nullptr; }

  /// Name and value by turns, values of any kind that has an exchange below.
  template <typename Value, typename... Rest>
  void fields(const char* name, Value& value, Rest&&... rest) {
    exchange(name, value);
    if constexpr (sizeof...(rest) > 0) fields(rest...);
  }

  template <typename Number>
  requires Whole<Number> || std::is_floating_point_v<Number>
  void exchange(const std::string& name, Number& value) { exchange_with(&Record::scalars, name, value); }

  void exchange(const std::string& name, std::string& value) { exchange_with(&Record::strings, name, value); }

  template <typename Derived>
  void exchange(const std::string& name, Eigen::PlainObjectBase<Derived>& values) {
    if constexpr (std::is_same_v<typename Derived::Scalar, double>) {
      exchange_with(&Record::matrices, name, values.derived());
    } else {
      Eigen::MatrixXi whole = values.derived().matrix().template cast<int>();
      exchange_with(&Record::index_matrices, name, whole);
      values.derived() = whole.template cast<typename Derived::Scalar>();
    }
  }

  template <Whole Number>
  void exchange(const std::string& name, std::vector<Number>& values) {
    Eigen::VectorXi column(static_cast<Eigen::Index>(values.size()));
    for (Eigen::Index i = 0; i < column.size(); ++i) column[i] = static_cast<int>(values[static_cast<std::size_t>(i)]);
    exchange_with(&Record::index_matrices, name, column);
    values.resize(static_cast<std::size_t>(column.size()));
    for (Eigen::Index i = 0; i < column.size(); ++i) values[static_cast<std::size_t>(i)] = static_cast<Number>(column[i]);
  }

  /// One column of twelve numbers for each pose.
  void exchange(const std::string& name, std::vector<Eigen::Affine3d>& poses) {
    Eigen::MatrixXd columns(12, static_cast<Eigen::Index>(poses.size()));
    for (Eigen::Index i = 0; i < columns.cols(); ++i)
      columns.col(i) = poses[static_cast<std::size_t>(i)].affine().reshaped();
    exchange_with(&Record::matrices, name, columns);
    poses.resize(static_cast<std::size_t>(columns.cols()));
    for (Eigen::Index i = 0; i < columns.cols(); ++i)
      poses[static_cast<std::size_t>(i)] =
          Eigen::Affine3d(Eigen::Map<const Eigen::Matrix<double, 3, 4>>(columns.col(i).data()));
  }

  void exchange(const std::string& name, std::vector<std::string>& values) { list(name, name, values); }

  template <typename Value>
  void exchange(const std::string& name, std::optional<Value>& value) {
    bool is_there = value.has_value();
    exchange(name, is_there);
    if (!is_there) return;
    if (!value) value.emplace();
    exchange(name, *value);
  }

  /// Any type for which there is a name_fields.
  template <typename Value>
  requires requires(RecordArchive& archive, Value& value) { name_fields(archive, value); }
  void exchange(const std::string& name, Value& value) {
    const std::string outer = at_;
    at_ += name + "/";
    name_fields(*this, value);
    at_ = outer;
  }

  /// The number of values under the name `count`, value i under "entry/i" and what follows it.
  template <typename Value>
  void list(const std::string& count, const std::string& entry, std::vector<Value>& values, const std::string& behind = "") {
    std::size_t size = values.size();
    exchange(count, size);
    values.resize(size);
    for (std::size_t i = 0; i < size; ++i) exchange(entry + "/" + std::to_string(i) + behind, values[i]);
  }

 private:
  RecordArchive(Record* to, const Record* from) : to_(to), from_(from) {}

  template <typename Kept, typename Value>
  void exchange_with(std::map<std::string, Kept> Record::*table, const std::string& name, Value& value) {
    if (is_loading())
      value = static_cast<Value>((from_->*table).at(at_ + name));
    else
      (to_->*table)[at_ + name] = static_cast<Kept>(value);
  }

  Record* to_;
  const Record* from_;
  std::string at_;  // the names of the types around, each with a slash
};

}  // namespace hydrostat::io
