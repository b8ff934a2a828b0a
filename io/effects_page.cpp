#include "io/effects_page.h"

#include <algorithm>

#include "io/svg_text.h"

namespace hydrostat::io {

using retarget::EffectRow;

namespace {

constexpr double kWidth = 760, kLabel = 100, kBar = 190, kLine = 24, kTop = 86, kGap = 150;  // [px]

std::string bar(double x, double y, double share, const char* colour, const std::string& text) {
  return "<rect x=\"" + short_number(x) + "\" y=\"" + short_number(y) + "\" width=\"" + short_number(std::max(0.0, share) * kBar, 4) +
         "\" height=\"14\" fill=\"" + colour + "\"/><text x=\"" + short_number(x + std::max(0.0, share) * kBar + 4, 5) +
         "\" y=\"" + short_number(y + 11) + "\">" + text + "</text>";
}

std::string guarded(const EffectRow& row) {
  return row.guard_steps == 0 ? "" : " (guard: " + std::to_string(row.guard_steps) + " steps)";
}

}  // namespace

std::string effects_csv(const std::vector<EffectRow>& rows) {
  std::string csv = "effect,ms_per_sim_s,difference_length,stable,guard_steps\n";
  for (const EffectRow& row : rows) {
    csv += row.effect + "," + short_number(row.ms_per_sim_s, 6) + "," + short_number(row.difference_length, 6) +
           (row.stable ? ",1," : ",0,") + std::to_string(row.guard_steps) + "\n";
  }
  return csv;
}

std::string effects_svg(const std::string& subject, const std::vector<EffectRow>& rows) {
  double most_ms = 1e-12, most_difference = 1e-12;
  for (const EffectRow& row : rows) {
    most_ms = std::max(most_ms, row.ms_per_sim_s);
    most_difference = std::max(most_difference, row.difference_length);
  }
  const double height = kTop + kLine * static_cast<double>(rows.size()) + 10;
  std::string svg =
      "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 " + short_number(kWidth) + " " + short_number(height) +
      "\" role=\"img\" font-family=\"sans-serif\" font-size=\"11\"><rect width=\"100%\" height=\"100%\" fill=\"#fff\"/>\n"
      "<text x=\"8\" y=\"20\" font-size=\"14\" font-weight=\"bold\">What each effect costs and does: " +
      escaped(subject) +
      "</text>\n<text x=\"8\" y=\"38\">Each effect alone, and all together: a long bar on the left that has none on the "
      "right is time for nothing.</text>\n<text x=\"8\" y=\"53\">Where a body without volume or damping turns elements "
      "inside out "
      "the guard steps in, which takes time of its own.</text>\n<text x=\"" +
      short_number(kLabel) + "\" y=\"76\">processor time [ms for a simulated second]</text><text x=\"" +
      short_number(kLabel + kBar + kGap) + "\" y=\"76\">motion's difference to none [% of L, RMS]</text>\n";
  for (std::size_t k = 0; k < rows.size(); ++k) {
    const double y = kTop + kLine * static_cast<double>(k);
    svg += "<text x=\"" + short_number(kLabel - 6) + "\" y=\"" + short_number(y + 11) + "\" text-anchor=\"end\">" + rows[k].effect +
           "</text>" +
           bar(kLabel, y, rows[k].ms_per_sim_s / most_ms, "#1f6fb4", short_number(rows[k].ms_per_sim_s) + guarded(rows[k])) +
           bar(kLabel + kBar + kGap, y, rows[k].difference_length / most_difference, "#d2691e",
               short_number(100 * rows[k].difference_length)) +
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
      "<table><tr><th>effect<th>ms a second<th>difference [% L]<th>stable<th>steps by the guard</tr>\n";
  for (const EffectRow& row : rows) {
    html += "<tr><td>" + row.effect + "<td>" + short_number(row.ms_per_sim_s) + "<td>" + short_number(100 * row.difference_length) +
            "<td>" + (row.stable ? "yes" : "no") + "<td>" + std::to_string(row.guard_steps) + "</tr>\n";
  }
  return html + "</table>\n</html>\n";
}

}  // namespace hydrostat::io
