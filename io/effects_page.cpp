#include "io/effects_page.h"

#include <algorithm>
#include <cmath>

#include "io/svg_text.h"

namespace hydrostat::io {

using retarget::EffectRow;

namespace {

constexpr double kWidth = 900, kLabel = 100, kBar = 120, kLine = 24, kTop = 116, kGap = 145;  // [px]

std::string bar(double x, double y, double share, const char* colour, const std::string& text) {
  return "<rect x=\"" + short_number(x) + "\" y=\"" + short_number(y) + "\" width=\"" + short_number(std::max(0.0, share) * kBar, 4) +
         "\" height=\"14\" fill=\"" + colour + "\"/><text x=\"" + short_number(x + std::max(0.0, share) * kBar + 4, 5) +
         "\" y=\"" + short_number(y + 11) + "\">" + text + "</text>";
}

/// Without what lies below round-off: two orders of the same sums differ by it.
std::vector<EffectRow> rounded(std::vector<EffectRow> rows) {
  constexpr double kRoundOff = 1e-11;  // per L
  for (EffectRow& row : rows) {
    for (double* difference : {&row.difference_length, &row.without_difference_length}) {
      if (std::abs(*difference) < kRoundOff) *difference = 0;
    }
  }
  return rows;
}

std::string guarded(const EffectRow& row) {
  return row.guard_steps == 0 ? "" : " (guard: " + std::to_string(row.guard_steps) + " steps)";
}

}  // namespace

std::string effects_csv(const std::vector<EffectRow>& rows) {
  std::string csv = "effect,ms_per_sim_s,difference_length,stable,guard_steps,without_ms_per_sim_s,without_difference_length\n";
  for (const EffectRow& row : rounded(rows)) {
    csv += row.effect + "," + short_number(row.ms_per_sim_s, 6) + "," + short_number(row.difference_length, 6) +
           (row.stable ? ",1," : ",0,") + std::to_string(row.guard_steps) + "," + short_number(row.without_ms_per_sim_s, 6) + "," +
           short_number(row.without_difference_length, 6) + "\n";
  }
  return csv;
}

std::string effects_svg(const std::string& subject, const std::vector<EffectRow>& measured) {
  const std::vector<EffectRow> rows = rounded(measured);
  double most_ms = 1e-12, most_alone = 1e-12, most_without = 1e-12;
  for (const EffectRow& row : rows) {
    most_ms = std::max(most_ms, row.ms_per_sim_s);
    most_alone = std::max(most_alone, row.difference_length);
    most_without = std::max(most_without, row.without_difference_length);
  }
  const double height = kTop + kLine * static_cast<double>(rows.size()) + 10, step = kBar + kGap;
  const auto line = [](double x, double y, const std::string& text) {
    return "<text x=\"" + short_number(x) + "\" y=\"" + short_number(y) + "\">" + text + "</text>\n";
  };
  std::string svg =
      "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 " + short_number(kWidth) + " " + short_number(height) +
      "\" role=\"img\" font-family=\"sans-serif\" font-size=\"11\"><rect width=\"100%\" height=\"100%\" fill=\"#fff\"/>\n"
      "<text x=\"8\" y=\"20\" font-size=\"14\" font-weight=\"bold\">What each effect costs and does: " +
      escaped(subject) + "</text>\n" +
      line(8, 38, "Each effect alone, and all together: time (blue), and how far the motion differs from that without any (orange).") +
      line(8, 53, "What acts only together with others, as the ground does with weight, shows on the right (green): all but this one, against all.") +
      line(8, 68, "Without an orange and a green bar an effect changes nothing here. Where a body without volume or damping turns elements") +
      line(8, 83, "inside out the guard steps in, which takes time of its own.") +
      line(kLabel, 106, "processor time [ms for a simulated second]") +
      line(kLabel + step, 106, "alone, to none [% of L, RMS]") +
      line(kLabel + 2 * step, 106, "left out, to all [% of L, RMS]");
  for (std::size_t k = 0; k < rows.size(); ++k) {
    const double y = kTop + kLine * static_cast<double>(k);
    const EffectRow& row = rows[k];
    svg += "<text x=\"" + short_number(kLabel - 6) + "\" y=\"" + short_number(y + 11) + "\" text-anchor=\"end\">" + row.effect + "</text>" +
           bar(kLabel, y, row.ms_per_sim_s / most_ms, "#1f6fb4", short_number(row.ms_per_sim_s) + guarded(row)) +
           bar(kLabel + step, y, row.difference_length / most_alone, "#d2691e", short_number(100 * row.difference_length)) +
           bar(kLabel + 2 * step, y, row.without_difference_length / most_without, "#2e8b57",
               short_number(100 * row.without_difference_length)) +
           "\n";
  }
  return svg + "</svg>\n";
}

std::string effects_page(const std::string& subject, const std::vector<EffectRow>& rows) {
  std::string html =
      "<!DOCTYPE html>\n<html lang=\"en\"><meta charset=\"utf-8\"><title>Effects</title>\n<style>body{font:14px "
      "sans-serif;max-width:900px;"
      "margin:2em auto;padding:0 1em}table{border-collapse:collapse}th,td{border:1px solid #ccc;padding:.25em "
      ".5em;text-align:right}</style>\n"
      "<h1>Effects of " +
      escaped(subject) + "</h1>\n" + effects_svg(subject, rows) +
      "<table><tr><th>effect<th>ms a second<th>alone, to none [% L]<th>stable<th>steps by the guard<th>ms a second of all others<th>all others, to all [% L]</tr>\n";
  for (const EffectRow& row : rounded(rows)) {
    html += "<tr><td>" + row.effect + "<td>" + short_number(row.ms_per_sim_s) + "<td>" + short_number(100 * row.difference_length) +
            "<td>" + (row.stable ? "yes" : "no") + "<td>" + std::to_string(row.guard_steps) + "<td>" + short_number(row.without_ms_per_sim_s) +
            "<td>" + short_number(100 * row.without_difference_length) + "</tr>\n";
  }
  return html + "</table>\n</html>\n";
}

}  // namespace hydrostat::io
