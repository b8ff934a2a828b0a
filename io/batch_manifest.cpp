#include "io/batch_manifest.h"

#include <toml++/toml.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <map>

#include "io/write_file.h"
#include "retarget/error.h"

namespace hydrostat::io {

namespace fs = std::filesystem;

namespace {

using Options = std::map<std::string, std::vector<std::string>>;  // "--limit" -> the arguments that give it, by alphabet

int line_of(const toml::node& node) { return static_cast<int>(node.source().begin.line); }

Error manifest_error(const fs::path& manifest, int line, const std::string& what, const std::string& mend) {
  return {manifest.string(), "line " + std::to_string(line), what, mend};
}

std::string option_name(std::string_view key) {
  if (key == "clip_name") return "--clip";
  std::string name = "--" + std::string(key);
  std::replace(name.begin(), name.end(), '_', '-');
  return name;
}

/// The text of a number or string as an argument, empty when it is neither: a number as short as reads back the same.
std::string argument(const toml::node& node) {
  if (const auto* text = node.as_string()) return **text;
  if (const auto* number = node.as_integer()) return std::to_string(**number);
  if (const auto* number = node.as_floating_point()) {
    std::array<char, 32> digits;
    return {digits.data(), std::to_chars(digits.begin(), digits.end(), **number).ptr};
  }
  return "";
}

std::vector<std::string> arguments(const fs::path& manifest, std::string_view key, const toml::node& node) {
  const std::string option = option_name(key);
  if (const auto* flag = node.as_boolean()) return **flag ? std::vector<std::string>{option} : std::vector<std::string>{};
  std::vector<std::string> result;
  const auto add = [&](const toml::node& value) {
    const std::string text = argument(value);
    if (text.empty()) {
      throw manifest_error(manifest, line_of(value), "'" + std::string(key) + "' has no value that an option can take",
                           "Give it a number, a text, true or false, or a list of numbers or texts.");
    }
    result.push_back(option + "=" + text);
  };
  if (const toml::array* list = node.as_array()) {
    for (const toml::node& value : *list) add(value);
  } else {
    add(node);
  }
  return result;
}

std::string required_text(const fs::path& manifest, const toml::table& job, const std::string& key) {
  const toml::node* node = job.get(key);
  if (node == nullptr || !node->is_string() || (**node->as_string()).empty()) {
    throw manifest_error(manifest, line_of(node == nullptr ? static_cast<const toml::node&>(job) : *node),
                         "the job has no text '" + key + "'", "Add " + key + " = \"...\" below its [[job]].");
  }
  return **node->as_string();
}

Options read_defaults(const fs::path& manifest, const toml::node& node) {
  const toml::table* table = node.as_table();
  if (table == nullptr) throw manifest_error(manifest, line_of(node), "'defaults' is not a table", "Write [defaults].");
  Options options;
  for (const auto& [key, value] : *table) {
    if (key == "clip" || key == "out" || key == "name") {
      throw manifest_error(manifest, line_of(value), "[defaults] cannot give '" + std::string(key.str()) + "'",
                           "Give it in each [[job]].");
    }
    options[option_name(key.str())] = arguments(manifest, key.str(), value);
  }
  return options;
}

BatchJob read_job(const fs::path& manifest, const toml::node& node, Options options) {
  const toml::table* table = node.as_table();
  if (table == nullptr)
    throw manifest_error(manifest, line_of(node), "a job is not a table", "Write [[job]] on a line of its own.");
  const fs::path directory = fs::absolute(manifest).parent_path();
  BatchJob job;
  job.line = line_of(node);
  job.clip = (directory / required_text(manifest, *table, "clip")).lexically_normal();
  job.out = (directory / required_text(manifest, *table, "out")).lexically_normal();
  if (!job.out.has_filename()) job.out = job.out.parent_path();
  job.name = table->contains("name") ? required_text(manifest, *table, "name") : job.out.filename().string();
  for (const auto& [key, value] : *table) {
    if (key == "clip" || key == "out" || key == "name") continue;
    options[option_name(key.str())] = arguments(manifest, key.str(), value);
  }
  for (const auto& [name, given] : options) job.options.insert(job.options.end(), given.begin(), given.end());
  return job;
}

void refuse_same_out(const fs::path& manifest, const std::vector<BatchJob>& jobs) {
  std::map<fs::path, int> line_of_out;
  for (const BatchJob& job : jobs) {
    const auto [first, is_new] = line_of_out.emplace(job.out, job.line);
    if (is_new) continue;
    throw manifest_error(manifest, job.line,
                         "the job writes to the same 'out' as the job of line " + std::to_string(first->second),
                         "Give each job an 'out' of its own.");
  }
}

}  // namespace

std::vector<BatchJob> read_batch_manifest(const fs::path& manifest) {
  const std::string text = read_file(manifest);
  toml::table root;
  try {
    root = toml::parse(text, manifest.string());
  } catch (const toml::parse_error& error) {
    throw manifest_error(manifest, static_cast<int>(error.source().begin.line), std::string(error.description()),
                         "Mend the TOML of that line.");
  }
  for (const auto& [key, value] : root) {
    if (key == "defaults" || key == "job") continue;
    throw manifest_error(manifest, line_of(value), "'" + std::string(key.str()) + "' is not known",
                         "A manifest holds [defaults] and [[job]].");
  }
  const toml::node* defaults = root.get("defaults");
  const Options options = defaults == nullptr ? Options{} : read_defaults(manifest, *defaults);
  std::vector<BatchJob> jobs;
  if (const toml::array* list = root["job"].as_array()) {
    for (const toml::node& node : *list) jobs.push_back(read_job(manifest, node, options));
  }
  if (jobs.empty()) {
    throw Error(manifest.string(), "", "holds no job", "Add [[job]] with clip = \"...\" and out = \"...\".");
  }
  refuse_same_out(manifest, jobs);
  return jobs;
}

}  // namespace hydrostat::io
