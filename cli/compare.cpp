#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <iostream>
#include <memory>

#include "cli/command_line.h"
#include "cli/place_option.h"
#include "io/comparison.h"

namespace hydrostat::cli {

namespace fs = std::filesystem;

namespace {

constexpr const char* kCompareCommand = "hydrostat compare";
constexpr int kMost = 6;  // more are too small beside each other

struct CompareCommand {
  std::vector<std::string> subjects;
  std::string out;
  bool json = false;
};

std::string cell(const io::Figure& figure) {
  if (const bool* is_so = std::get_if<bool>(&figure)) return *is_so ? "yes" : "no";
  if (const auto* text = std::get_if<std::string>(&figure)) return *text;
  const double* value = std::get_if<double>(&figure);
  if (value == nullptr) return "-";
  char text[40];
  std::snprintf(text, sizeof text, "%.4g", *value);
  return text;
}

/// A line for each figure, a column for each run.
std::string table(const io::Comparison& comparison) {
  const std::vector<io::ComparedRun>& runs = comparison.runs;
  std::vector<std::vector<std::string>> lines{{""}};
  for (const io::ComparedRun& run : runs) lines.front().push_back(run.name);
  for (std::size_t f = 0; f < runs.front().figures.size(); ++f) {
    lines.push_back({runs.front().figures[f].first});
    for (const io::ComparedRun& run : runs) lines.back().push_back(cell(run.figures[f].second));
  }
  std::string text;
  for (const std::vector<std::string>& line : lines) {
    std::string row;
    for (std::size_t c = 0; c < line.size(); ++c) {
      std::size_t width = 0;
      for (const std::vector<std::string>& other : lines) width = std::max(width, other[c].size());
      const std::string space(width - line[c].size(), ' ');
      row += c == 0 ? line[c] + space : "  " + space + line[c];
    }
    text += row + "\n";
  }
  return text;
}

std::string distance_line(const io::Comparison& comparison, std::size_t k) {
  const io::RunDistance& distance = comparison.distances[k];
  const std::string &name = comparison.runs[k + 1].name, &first = comparison.runs.front().name;
  if (!distance.obstacle.empty())
    return name + ": its skin is not held against that of " + first + ": " + distance.obstacle + "\n";
  const retarget::SkinDistance& course = distance.course;
  const io::DistanceSummary whole = io::summary_of(course.distance_m, course.time_s),
                            shape = io::summary_of(course.shape_m, course.time_s);
  const double percent = 100 / comparison.length_m;
  char text[200];
  std::snprintf(text, sizeof text,
                "%.3g %% of L (RMS over %.3g s; at most %.3g %%, at %.2f s), %.3g %% without place and turn\n",
                percent * whole.rms_m, course.time_s[course.time_s.size() - 1], percent * whole.most_m, whole.most_time_s,
                percent * shape.rms_m);
  return name + ": its skin is away from that of " + first + " by " + text;
}

UsageError usage(const std::string& what, const std::string& mend) { return {kCompareCommand, "command line", what, mend}; }

void check_subjects(const std::vector<std::string>& subjects) {
  if (subjects.size() < 2) throw usage("there is nothing to compare with", "Name two creatures or more.");
  if (subjects.size() > kMost)
    throw usage("more than " + std::to_string(kMost) + " are too many for one page", "Name fewer.");
  std::vector<fs::path> places;
  for (const std::string& subject : subjects) {
    places.push_back(fs::weakly_canonical(subject));
    if (!places.back().has_filename()) places.back() = places.back().parent_path();
    if (std::count(places.begin(), places.end(), places.back()) > 1) {
      throw usage("'" + subject + "' is named twice", "Name different ones.");
    }
  }
}

int compare(const CompareCommand& command) {
  check_subjects(command.subjects);
  if (!command.out.empty() && fs::path(command.out).extension() != ".html") {
    throw UsageError(kCompareCommand, "option --out", "'" + command.out + "' does not end with .html",
                     "The comparison is written as a page.");
  }
  const io::Comparison comparison = io::compare_runs(command.subjects);
  if (!command.out.empty()) {
    for (const io::ComparedRun& run : comparison.runs) {
      if (fs::weakly_canonical(run.page.file) != fs::weakly_canonical(command.out)) continue;
      throw UsageError(kCompareCommand, "option --out", "'" + command.out + "' is one of the pages that are compared",
                       "Name another file.");
    }
    io::write_comparison_page(command.out, comparison);
  }
  if (command.json) {
    std::cout << io::comparison_json(comparison);
    return kDone;
  }
  std::cout << table(comparison);
  for (std::size_t k = 0; k < comparison.distances.size(); ++k) std::cout << distance_line(comparison, k);
  return kDone;
}

}  // namespace

void add_compare(CLI::App& app, int& exit_code) {
  const auto command = std::make_shared<CompareCommand>();
  CLI::App* sub = app.add_subcommand("compare", "Motions of creatures or scenes side by side, with their figures");
  sub->add_option("DIR", command->subjects,
                  "Creatures, directories of 'simulate', or report pages; the others are held against the first")
      ->required();
  sub->add_option("-o,--out", command->out, "Write a page with all motions, to this .html file")->check(refuse_no_place);
  sub->add_flag("--json", command->json, "Print the comparison as JSON");
  sub->callback([command, &exit_code] { exit_code = compare(*command); });
}

}  // namespace hydrostat::cli
