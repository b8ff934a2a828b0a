#include "io/signals_plot.h"

#include <algorithm>
#include <cstdio>

#include "io/svg_text.h"

namespace hydrostat::io {

namespace {

// Layout [px].
constexpr int kColumns = 3;
constexpr int kPanelWidth = 360;
constexpr int kPanelHeight = 180;
constexpr int kLeft = 46;  // within a panel, for the numbers of the axis
constexpr int kRight = 14;
constexpr int kTop = 26;
constexpr int kBottom = 28;
constexpr int kTitle = 40;

constexpr int kFewestPoints = 120;  // a line

std::string number(double value, int decimals) {
  char text[32];
  std::snprintf(text, sizeof text, "%.*f", decimals, value);
  return text;
}

/// Where time and activation fall on the page.
struct Panel {
  double x0, y0;     // upper left corner of the plot area [px]
  double low, high;  // activation at its lower and upper edge [-]

  static constexpr double width() { return kPanelWidth - kLeft - kRight; }
  static constexpr double height() { return kPanelHeight - kTop - kBottom; }
  double x(double part_of_period) const { return x0 + part_of_period * width(); }
  double y(double activation) const { return y0 + (high - activation) / (high - low) * height(); }
};

std::string text_at(double x, double y, const char* anchor, const std::string& text) {
  return "<text x=\"" + number(x, 1) + "\" y=\"" + number(y, 1) + "\" text-anchor=\"" + anchor + "\">" + escaped(text) +
         "</text>\n";
}

/// One column of samples, uniform from the left edge to the right.
std::string line(const Panel& panel, const Eigen::Ref<const Eigen::VectorXd>& samples, const char* style,
                 const std::string& name) {
  std::string text = std::string("<polyline class=\"") + style + "\" points=\"";
  const double last = static_cast<double>(samples.size() - 1);
  for (Eigen::Index j = 0; j < samples.size(); ++j) {
    text += number(panel.x(static_cast<double>(j) / last), 1) + "," + number(panel.y(samples[j]), 1) + " ";
  }
  text.back() = '"';
  return text + "><title>" + escaped(name) + "</title></polyline>\n";
}

std::string level(const Panel& panel, double activation, const char* style) {
  const std::string y = number(panel.y(activation), 1);
  return std::string("<line class=\"") + style + "\" x1=\"" + number(panel.x(0), 1) + "\" x2=\"" + number(panel.x(1), 1) +
         "\" y1=\"" + y + "\" y2=\"" + y + "\"/>\n" +
         text_at(panel.x(0) - 5, panel.y(activation) + 4, "end", number(activation, 2));
}

/// Values from the first to the end of the period, the end included, so that a loop closes.
Eigen::MatrixXd curves(const signal::Spectrum& spectrum, double low, double high) {
  const int points = std::max(kFewestPoints, spectrum.samples) + 1;
  signal::Synthesiser player(spectrum, points - 1, low, high);
  Eigen::MatrixXd values(spectrum.channels(), points);
  for (int j = 0; j < points; ++j) player.at(j, values.col(j));
  return values.transpose();
}

std::string axes(const Panel& panel, const retarget::SignalSet& set, const retarget::BoneSignals& bone) {
  const std::string count = std::to_string(bone.channels.size()) + (bone.channels.size() == 1 ? " channel" : " channels");
  return text_at(panel.x0, panel.y0 - 9, "start", bone.bone + " (" + count + ")") + level(panel, 1 - set.limit, "limit") +
         level(panel, retarget::kPassiveActivation, "rest") + level(panel, 1 + set.limit, "limit") +
         text_at(panel.x(0), panel.y0 + Panel::height() + 16, "start", "0") +
         text_at(panel.x(1), panel.y0 + Panel::height() + 16, "end", number(set.period_s, 3) + " s");
}

std::string lines(const Panel& panel, const retarget::SignalSet& set, const retarget::BoneSignals& bone,
                  const Eigen::MatrixXd& values, const char* style) {
  std::string text;
  for (const int c : bone.channels)
    text += line(panel, values.col(c), style, set.channels[static_cast<std::size_t>(c)].name);
  return text;
}

}  // namespace

std::string signals_plot(const retarget::SignalSet& set, const retarget::EditedActivations& edited,
                         const std::vector<retarget::BoneSignals>& bones) {
  const double low = retarget::kPassiveActivation - set.limit;
  const double high = retarget::kPassiveActivation + set.limit;
  const double margin = 0.1 * set.limit;
  const Eigen::MatrixXd now = curves(edited.spectrum, low, high);
  const Eigen::MatrixXd solved = curves(set.activation, low, high);
  const int rows = (static_cast<int>(bones.size()) + kColumns - 1) / kColumns;
  const std::string size = "width=\"" + std::to_string(kColumns * kPanelWidth) + "\" height=\"" +
                           std::to_string(kTitle + rows * kPanelHeight) + "\"";
  std::string text = "<svg xmlns=\"http://www.w3.org/2000/svg\" " + size +
                     " font-family=\"sans-serif\" font-size=\"11\">\n<style>polyline{fill:none;stroke-width:1}"
                     ".now{stroke:#1f5fae;stroke-opacity:.6}.solved{stroke:#999;stroke-opacity:.5}"
                     ".rest{stroke:#bbb}.limit{stroke:#b33;stroke-dasharray:4 3}</style>\n<rect " +
                     size + " fill=\"#fff\"/>\n";
  text += text_at(kLeft, 24, "start",
                  "Activation (commanded rest length / rest length) over " +
                      std::string(set.kind() == signal::Kind::loop ? "one period" : "the whole motion") + ", " +
                      std::to_string(set.layers.size()) + " layers" + (set.layers.empty() ? "" : ", as solved in grey") +
                      ", " + std::to_string(edited.clipped) + " samples held at a limit");
  for (std::size_t b = 0; b < bones.size(); ++b) {
    const auto place = static_cast<int>(b);
    const Panel panel{static_cast<double>(place % kColumns * kPanelWidth + kLeft),
                      static_cast<double>(kTitle + place / kColumns * kPanelHeight + kTop), low - margin, high + margin};
    text += axes(panel, set, bones[b]);
    if (!set.layers.empty()) text += lines(panel, set, bones[b], solved, "solved");
    text += lines(panel, set, bones[b], now, "now");
  }
  return text + "</svg>\n";
}

}  // namespace hydrostat::io
