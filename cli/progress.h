#pragma once

#include <iosfwd>
#include <string>

namespace hydrostat::cli {

enum class ProgressStyle { bar, lines, silent };

/// A bar where standard error is a terminal, plain lines where it is a log, nothing when `quiet`.
ProgressStyle progress_style(bool quiet);

/// Tells how far a command has come, one stage after the other. A bar is redrawn in its line, at whole percents; a log gets
/// a line when a stage begins, at every tenth of it, and when it ends.
class Progress {
 public:
  Progress(std::ostream& out, ProgressStyle style) : out_(out), style_(style) {}
  /// An open stage that an exception leaves ends its line, so that the message starts on a new one.
  ~Progress();
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  /// Begins a stage and ends the one before.
  void begin(const std::string& stage);
  /// share of the stage that is done, 0..1; a share that falls back is not shown.
  void reach(double share);
  /// Ends the stage; `outcome` is added to its line ("211 nodes").
  void end(const std::string& outcome = "");
  /// A line of its own that leaves a bar standing below it.
  void note(const std::string& line);

 private:
  void draw_bar();

  std::ostream& out_;
  ProgressStyle style_;
  std::string stage_;
  bool open_ = false;
  int percent_ = 0;
};

}  // namespace hydrostat::cli
