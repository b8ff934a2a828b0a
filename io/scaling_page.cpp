#include "io/scaling_page.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <nlohmann/json.hpp>

#include "io/svg_text.h"

namespace hydrostat::io {

using retarget::ScalingRow;

namespace {

// Layout of a diagram [px].
constexpr double kWidth = 560, kHeight = 300, kLeft = 60, kRight = 20, kTop = 34, kBottom = 44;

struct Curve {
  std::string name, colour;
  std::function<double(const ScalingRow&)> value;
};

/// Curves over the number of elements, x by its logarithm, y from 0.
std::string diagram(const std::vector<ScalingRow>& rows, const std::string& title, const std::vector<Curve>& curves) {
  double low = 1e300, high = 0, top = 0;
  for (const ScalingRow& row : rows) {
    low = std::min(low, std::log10(row.elements));
    high = std::max(high, std::log10(row.elements));
    for (const Curve& curve : curves) top = std::max(top, curve.value(row));
  }
  if (high - low < 1e-9) high = low + 1;
  if (top <= 0) top = 1;
  const auto x = [&](double elements) {
    return kLeft + (std::log10(elements) - low) / (high - low) * (kWidth - kLeft - kRight);
  };
  const auto y = [&](double value) { return kHeight - kBottom - value / (1.1 * top) * (kHeight - kTop - kBottom); };
  std::string svg = "<svg viewBox=\"0 0 " + short_number(kWidth) + " " + short_number(kHeight) + "\" role=\"img\"><text x=\"" +
                    short_number(kLeft) + "\" y=\"18\" class=\"title\">" + escaped(title) + "</text>\n";
  for (int k = 0; k <= 4; ++k) {
    const double value = 1.1 * top * k / 4;
    svg += "<line x1=\"" + short_number(kLeft) + "\" x2=\"" + short_number(kWidth - kRight) + "\" y1=\"" + short_number(y(value), 5) +
           "\" y2=\"" + short_number(y(value), 5) + "\" class=\"grid\"/><text x=\"" + short_number(kLeft - 6) + "\" y=\"" +
           short_number(y(value) + 4, 5) + "\" text-anchor=\"end\">" + short_number(value) + "</text>\n";
  }
  for (const ScalingRow& row : rows) {
    svg += "<text x=\"" + short_number(x(row.elements), 5) + "\" y=\"" + short_number(kHeight - kBottom + 16, 5) +
           "\" text-anchor=\"middle\">" +
           (row.elements >= 10000 ? short_number(row.elements / 1000.0) + "k" : std::to_string(row.elements)) + "</text>\n";
  }
  svg += "<text x=\"" + short_number(kWidth / 2) + "\" y=\"" + short_number(kHeight - 8) + "\" text-anchor=\"middle\">elements</text>\n";
  for (std::size_t c = 0; c < curves.size(); ++c) {
    std::string points;
    for (const ScalingRow& row : rows) points += short_number(x(row.elements), 5) + "," + short_number(y(curves[c].value(row)), 5) + " ";
    svg += "<polyline fill=\"none\" stroke-width=\"2\" stroke=\"" + curves[c].colour + "\" points=\"" + points +
           "\"/><text x=\"" + short_number(kWidth - kRight) + "\" y=\"" + short_number(kTop + 14 * static_cast<double>(c)) +
           "\" text-anchor=\"end\" fill=\"" + curves[c].colour + "\">" + escaped(curves[c].name) + "</text>\n";
  }
  return svg + "</svg>\n";
}

std::string table(const ScalingReport& report) {
  std::string html =
      "<table><tr><th>elements<th>nodes<th>substeps/s<th>ns, one thread, processor<th>ns, one thread, clock<th>ns, " +
      std::to_string(report.threads) +
      " threads, clock<th>bytes an element<th>memory's limit [ns]<th>arithmetic's limit [ns]</tr>\n";
  for (const ScalingRow& row : report.rows) {
    html += "<tr><td>" + std::to_string(row.elements) + "<td>" + std::to_string(row.nodes) + "<td>" +
            short_number(row.substeps_per_s, 4);
    for (const double value : {row.cpu_ns, row.one_ns, row.shared_ns, row.bytes, memory_limit_ns(report, row),
                               arithmetic_limit_ns(report, row)}) {
      html += "<td>" + (value > 0 ? short_number(value) : std::string("-"));
    }
    html += "</tr>\n";
  }
  return html + "</table>\n";
}

}  // namespace

double memory_limit_ns(const ScalingReport& report, const ScalingRow& row) {
  return 1e9 * row.work.bytes / report.machine.bytes_per_s;
}
double arithmetic_limit_ns(const ScalingReport& report, const ScalingRow& row) {
  return 1e9 * row.work.flops / report.machine.flops;
}

std::string scaling_csv(const ScalingReport& report) {
  std::string csv =
      "elements,nodes,substeps_per_s,cpu_ns,one_thread_ns,shared_ns,threads,bytes,flops_counted,bytes_counted,memory_limit_"
      "ns,arithmetic_limit_ns,whole\n";
  for (const ScalingRow& row : report.rows) {
    csv += std::to_string(row.elements) + "," + std::to_string(row.nodes);
    for (const double value : {row.substeps_per_s, row.cpu_ns, row.one_ns, row.shared_ns}) csv += "," + short_number(value, 6);
    csv += "," + std::to_string(report.threads);
    for (const double value :
         {row.bytes, row.work.flops, row.work.bytes, memory_limit_ns(report, row), arithmetic_limit_ns(report, row)}) {
      csv += "," + short_number(value, 6);
    }
    csv += row.is_whole ? ",1\n" : ",0\n";
  }
  return csv;
}

std::string scaling_json(const ScalingReport& report) {
  nlohmann::ordered_json json;
  json["schema"] = "hydrostat.scaling/1";
  json["scene"] = report.scene;
  json["method"] = report.method;
  json["threads"] = report.threads;
  json["machine"] = {{"bytes_per_s", report.machine.bytes_per_s}, {"flops", report.machine.flops}};
  json["exponent"] =
      report.rows.size() > 1 ? nlohmann::ordered_json(retarget::growth_exponent(report.rows)) : nlohmann::ordered_json();
  json["rows"] = nlohmann::ordered_json::array();
  for (const ScalingRow& row : report.rows) {
    json["rows"].push_back({{"elements", row.elements},
                            {"nodes", row.nodes},
                            {"substeps_per_s", row.substeps_per_s},
                            {"cpu_ns", row.cpu_ns},
                            {"one_thread_ns", row.one_ns},
                            {"shared_ns", row.shared_ns},
                            {"bytes", row.bytes},
                            {"flops_counted", row.work.flops},
                            {"bytes_counted", row.work.bytes},
                            {"memory_limit_ns", memory_limit_ns(report, row)},
                            {"arithmetic_limit_ns", arithmetic_limit_ns(report, row)},
                            {"whole", row.is_whole}});
  }
  return json.dump(1) + "\n";
}

std::string scaling_page(const ScalingReport& report) {
  const std::string threads = std::to_string(report.threads) + " threads";
  std::string html =
      "<!DOCTYPE html>\n<html lang=\"en\"><meta charset=\"utf-8\"><title>Scaling</title>\n<style>body{font:14px "
      "sans-serif;max-width:1180px;margin:2em "
      "auto;padding:0 "
      "1em}svg{width:560px;max-width:100%;font-size:11px}.grid{stroke:#ddd}.title{font-size:14px;font-weight:bold}table{"
      "border-collapse:"
      "collapse}th,td{border:1px solid #ccc;padding:.3em .6em;text-align:right}</style>\n";
  html += "<h1>Scaling of '" + escaped(report.method) + "', " + escaped(report.scene) + "</h1>\n<p>";
  if (report.rows.size() > 1) {
    html += "Processor time of a substep grows with the number of elements to the power " +
            short_number(retarget::growth_exponent(report.rows)) + ". ";
  }
  html += "This machine, one thread: " + short_number(1e-9 * report.machine.bytes_per_s) + " GB/s, " +
          short_number(1e-9 * report.machine.flops) +
          " Gflop/s. Limits are what the data of an element, each read or written once, and its operations would take at "
          "these rates; a body "
          "that fits the caches can be faster than the memory's.</p>\n";
  html += diagram(
      report.rows, "Time of an element and substep [ns], clock",
      {{"one thread", "#1f6fb4", [](const ScalingRow& row) { return row.one_ns; }},
       {threads, "#d2691e", [](const ScalingRow& row) { return row.shared_ns; }},
       {"memory's limit, one thread", "#888", [&](const ScalingRow& row) { return memory_limit_ns(report, row); }},
       {"arithmetic's limit, one thread", "#3a3", [&](const ScalingRow& row) { return arithmetic_limit_ns(report, row); }}});
  html += diagram(report.rows, "How much faster " + threads + " are",
                  {{"clock, one thread over " + threads, "#d2691e",
                    [](const ScalingRow& row) { return row.is_whole ? row.one_ns / row.shared_ns : 0; }}});
  html += diagram(report.rows, "Memory [bytes an element]",
                  {{"scene and stepper", "#1f6fb4", [](const ScalingRow& row) { return row.bytes; }}});
  return html + table(report) + "</html>\n";
}

}  // namespace hydrostat::io
