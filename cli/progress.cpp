#include "cli/progress.h"

#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <ostream>

namespace hydrostat::cli {

ProgressStyle progress_style(bool quiet) {
  if (quiet) return ProgressStyle::silent;
  return isatty(STDERR_FILENO) ? ProgressStyle::bar : ProgressStyle::lines;
}

Progress::~Progress() {
  if (open_ && style_ == ProgressStyle::bar) out_ << std::endl;
}

void Progress::begin(const std::string& stage) {
  if (open_) end();
  stage_ = stage;
  open_ = true;
  percent_ = 0;
  if (style_ == ProgressStyle::lines) out_ << stage_ << " ..." << std::endl;
  if (style_ == ProgressStyle::bar) draw_bar();
}

void Progress::reach(double share) {
  const int percent = static_cast<int>(std::floor(100 * std::clamp(share, 0.0, 1.0)));
  const int before = percent_;
  if (!open_ || percent <= before) return;
  percent_ = percent;
  if (style_ == ProgressStyle::bar) draw_bar();
  if (style_ == ProgressStyle::lines && percent / 10 > before / 10) {
    out_ << stage_ << " " << percent / 10 * 10 << " %" << std::endl;
  }
}

void Progress::end(const std::string& outcome) {
  if (!open_) return;
  open_ = false;
  if (style_ == ProgressStyle::silent) return;
  if (style_ == ProgressStyle::bar) out_ << "\r\033[K";
  out_ << stage_ << (outcome.empty() ? " done" : ": " + outcome) << std::endl;
}

void Progress::note(const std::string& line) {
  if (style_ == ProgressStyle::silent) return;
  if (style_ == ProgressStyle::bar) out_ << "\r\033[K";
  out_ << line << std::endl;
  if (style_ == ProgressStyle::bar && open_) draw_bar();
}

void Progress::draw_bar() {
  constexpr int kCells = 30;
  const int full = kCells * percent_ / 100;
  out_ << "\r\033[K" << stage_ << " [" << std::string(static_cast<std::size_t>(full), '#')
       << std::string(static_cast<std::size_t>(kCells - full), '.') << "] " << percent_ << " %" << std::flush;
}

}  // namespace hydrostat::cli
