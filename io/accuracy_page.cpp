#include "io/accuracy_page.h"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "io/label_places.h"
#include "io/svg_text.h"

namespace hydrostat::io {

using retarget::AccuracyRow;

namespace {

// Layout of the diagram [px].
constexpr double kWidth = 760, kHeight = 470, kLeft = 70, kRight = 150, kTop = 62, kBottom = 50;
constexpr double kMark = 6, kRing = 11;  // half of a point or cross, and of the ring around the recommended one

std::string percent(double share) { return short_number(100 * share) + " %"; }

const char* colour_of(const std::string& method) {
  if (method == "explicit") return "#1f6fb4";
  if (method == "implicit") return "#d2691e";
  if (method == "euler") return "#3a3";
  if (method == "xpbd") return "#a3c";
  return "#888";
}

std::string name_of(const AccuracyRow& row) {
  std::string name =
      row.method + ", " + std::to_string(row.nodes) + " nodes, " + row.element + " (" + row.material + "), step " + short_number(1000 * row.dt_s) + " ms";
  if (row.harmonics > 0) name += ", " + std::to_string(row.harmonics) + " harmonics";
  return name;
}

/// A logarithmic axis over whole decades.
struct Axis {
  double low = 1e300, high = -1e300, from, to;  // decades; pixels

  Axis(double from_px, double to_px) : from(from_px), to(to_px) {}
  void hold(double value) {
    if (!(value > 0) || !std::isfinite(value)) return;
    low = std::min(low, std::floor(std::log10(value)));
    high = std::max(high, std::ceil(std::log10(value)));
  }
  void finish() {
    if (high < low) low = high = 0;
    if (high - low < 1) high = low + 1;
  }
  double at(double value) const {
    const double decade = value > 0 ? std::log10(value) : low;
    return from + (std::clamp(decade, low, high) - low) / (high - low) * (to - from);
  }
};

double AccuracyRow::* time_of(const AccuracyCurve& curve) {
  return curve.is_counted ? &AccuracyRow::work_ms : &AccuracyRow::ms_per_sim_s;
}

std::string grid(const Axis& x, const Axis& y, bool is_counted) {
  std::string svg;
  for (double d = x.low; d <= x.high + 0.5; ++d) {
    const std::string at = short_number(x.at(std::pow(10, d)), 5);
    svg += "<line x1=\"" + at + "\" x2=\"" + at + "\" y1=\"" + short_number(kTop) + "\" y2=\"" + short_number(kHeight - kBottom) +
           "\" stroke=\"#ddd\"/><text x=\"" + at + "\" y=\"" + short_number(kHeight - kBottom + 16) +
           "\" text-anchor=\"middle\">" + short_number(std::pow(10, d), 7) + "</text>\n";
  }
  for (double d = y.low; d <= y.high + 0.5; ++d) {
    const std::string at = short_number(y.at(std::pow(10, d)), 5);
    svg += "<line x1=\"" + short_number(kLeft) + "\" x2=\"" + short_number(kWidth - kRight) + "\" y1=\"" + at + "\" y2=\"" + at +
           "\" stroke=\"#ddd\"/><text x=\"" + short_number(kLeft - 6) + "\" y=\"" + short_number(y.at(std::pow(10, d)) + 4, 5) +
           "\" text-anchor=\"end\">" + short_number(100 * std::pow(10, d), 7) + " %</text>\n";
  }
  svg += "<text x=\"" + short_number((kLeft + kWidth - kRight) / 2) + "\" y=\"" + short_number(kHeight - 12) +
         "\" text-anchor=\"middle\">processor time" + (is_counted ? ", as counted" : "") + " [ms for a simulated second]</text>\n";
  svg += "<text transform=\"translate(16 " + short_number((kTop + kHeight - kBottom) / 2) +
         ") rotate(-90)\" text-anchor=\"middle\">error [% of L, RMS over the skin]</text>\n";
  return svg;
}

std::string sentence(const AccuracyCurve& curve) {
  if (curve.recommended < 0) return "No setting stays within " + percent(curve.max_error) + " of L.";
  const AccuracyRow& row = curve.rows[static_cast<std::size_t>(curve.recommended)];
  const std::string loop = row.loop_error_m >= 0 ? ", closed loop too" : "";
  return std::string("Ringed: the least ") + (curve.is_counted ? "work" : "processor time") + " within " + percent(curve.max_error) + " of L" + loop + ": " + name_of(row) + ".";
}

std::string second_sentence(const AccuracyCurve& curve) {
  std::string text = "Down and to the left is better; the line joins what nothing beats in both";
  if (std::any_of(curve.rows.begin(), curve.rows.end(), [](const AccuracyRow& row) { return row.is_refused; })) {
    text += "; crossed: refused, for what its whole run came to";
  }
  return text + ".";
}

/// A cross over a point of what was refused.
std::string cross(double x, double y) {
  std::string svg;
  for (const double slope : {1.0, -1.0}) {
    svg += "<line x1=\"" + short_number(x - 6, 5) + "\" x2=\"" + short_number(x + 6, 5) + "\" y1=\"" + short_number(y - 6 * slope, 5) +
           "\" y2=\"" + short_number(y + 6 * slope, 5) + "\" stroke=\"#c33\" stroke-width=\"1.5\"/>";
  }
  return svg;
}

std::string loop_in_words(const AccuracyRow& row, double length_per_m) {
  if (row.falls) return "falls";
  return row.loop_error_m >= 0 ? short_number(100 * row.loop_error_m * length_per_m) : "-";
}

std::string table(const AccuracyCurve& curve, const std::vector<bool>& front) {
  std::string html =
      "<table><tr><th>method<th>element<th>material<th>nodes<th>step [ms]<th>iterations a step<th>harmonics<th>error [m]<th>error [% "
      "L]<th>closed loop [% L]<th>ms a "
      "second<th>counted [ms]<th>volume's error [%]<th>momentum unexplained [m g]<th>angular [m g "
      "L]<th>stable<th>front</tr>\n";
  for (std::size_t k = 0; k < curve.rows.size(); ++k) {
    const AccuracyRow& row = curve.rows[k];
    html += "<tr id=\"row" + std::to_string(k) + "\"" +
            (static_cast<int>(k) == curve.recommended ? " class=\"chosen\"" : "") + "><td>" + row.method + "<td>" +
            row.element + "<td>" + row.material + "<td>" + std::to_string(row.nodes) + "<td>" + short_number(1000 * row.dt_s) + "<td>" +
            short_number(row.iterations) + "<td>" + (row.harmonics > 0 ? std::to_string(row.harmonics) : "-");
    const auto add = [&](double value) { html += "<td>" + (std::isfinite(value) ? short_number(value) : std::string("-")); };
    add(row.error_rms_m);
    add(100 * row.error_rel_length);
    html += "<td>" + loop_in_words(row, row.error_rms_m > 0 ? row.error_rel_length / row.error_rms_m : 0);
    for (const double value : {row.ms_per_sim_s, row.work_ms, 100 * row.volume_error, row.momentum_error, row.angular_error}) add(value);
    html += std::string("<td>") + (row.falls ? "falls" : row.is_refused ? "refused" : row.stable ? "yes" : "no") + "<td>" + (front[k] ? "yes" : "") + "</tr>\n";
  }
  return html + "</table>\n";
}

}  // namespace

std::string accuracy_csv(const AccuracyCurve& curve) {
  std::string csv =
      "method,element,nodes,dt_s,iterations,harmonics,error_rms_m,error_rel_length,ms_per_sim_s,volume_error,momentum_error,"
      "angular_error,stable\n";
  for (const AccuracyRow& row : curve.rows) {
    csv += row.method + "," + row.element + "," + std::to_string(row.nodes) + "," + short_number(row.dt_s, 9) + "," +
           short_number(row.iterations, 6) + "," + std::to_string(row.harmonics);
    for (const double value : {row.error_rms_m, row.error_rel_length, row.ms_per_sim_s, row.volume_error, row.momentum_error,
                               row.angular_error}) {
      csv += "," + short_number(value, 6);
    }
    csv += row.stable ? ",1\n" : ",0\n";
  }
  return csv;
}

namespace {

constexpr Box kPlot{kLeft, kTop, kWidth - kRight, kHeight - kBottom};

/// Methods in the order of the rows.
std::vector<std::string> methods_of(const AccuracyCurve& curve) {
  std::vector<std::string> methods;
  for (const AccuracyRow& row : curve.rows) {
    if (row.stable && std::find(methods.begin(), methods.end(), row.method) == methods.end()) methods.push_back(row.method);
  }
  return methods;
}

std::string legend(const std::vector<std::string>& methods, LabelPlaces& places) {
  const std::string left = short_number(kWidth - kRight + 14);
  double line = kTop + 14;
  std::string svg;
  const auto add = [&](const std::string& colour, const std::string& text) {
    svg += "<text x=\"" + left + "\" y=\"" + short_number(line) + "\" fill=\"" + colour + "\">" + text + "</text>\n";
    line += 16;
  };
  for (const std::string& method : methods) add(colour_of(method), "&#9679; " + method);
  add("#666", "&#9679; tets, triangles");
  add("#666", "&#9675; hexahedra, quads");
  places.take({kWidth - kRight, kTop, kWidth, line});
  return svg;
}

std::string floor_line(double y, LabelPlaces& places) {
  const std::string at = short_number(y, 5), text = "the reference's own";
  const double left = kWidth - kRight + 4, width = label_width(text.size());
  const auto place = places.place(left + width / 2, y, width, {left, kTop, kWidth, kHeight - kBottom + kLabelHeight});
  return "<line x1=\"" + short_number(kLeft) + "\" x2=\"" + short_number(kWidth - kRight) + "\" y1=\"" + at + "\" y2=\"" + at +
         "\" stroke=\"#c33\" stroke-dasharray=\"4 3\"/><text x=\"" + short_number(left) + "\" y=\"" +
         short_number((place ? place->second : y) + 4, 5) + "\" fill=\"#c33\">" + text + "</text>\n";
}

/// A cross where a row would be that falls, and beside it, where there is room, what it is.
std::string fallen(const AccuracyRow& row, double x, double y, LabelPlaces& places) {
  const std::string text = std::to_string(row.nodes) + " nodes: falls";
  std::string svg = "<g><title>" + escaped(name_of(row)) + ": falls</title>" + cross(x, y);
  if (const auto place = places.place(x, y - kLabelHeight, label_width(text.size()), kPlot)) {
    svg += "<text x=\"" + short_number(place->first, 5) + "\" y=\"" + short_number(place->second + 4, 5) +
           "\" text-anchor=\"middle\" fill=\"#c33\">" + text + "</text>";
  }
  return svg + "</g>\n";
}

/// `has_links`: every point leads to `#row<n>`.
std::string diagram(const AccuracyCurve& curve, bool has_links) {
  Axis x(kLeft, kWidth - kRight), y(kHeight - kBottom, kTop);
  const auto time = time_of(curve);
  for (const AccuracyRow& row : curve.rows) {
    if (!row.stable && !row.falls) continue;
    x.hold(row.*time);
    y.hold(std::max(row.error_rel_length, 0.1 * curve.floor));
  }
  x.finish();
  y.finish();
  std::string svg =
      "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 " + short_number(kWidth) + " " + short_number(kHeight) +
      "\" role=\"img\" font-family=\"sans-serif\" font-size=\"11\"><rect width=\"100%\" height=\"100%\" "
      "fill=\"#fff\"/>\n<text x=\"" +
      short_number(kLeft) + "\" y=\"20\" font-size=\"14\" font-weight=\"bold\">What accuracy costs: " + escaped(curve.subject) +
      "</text>\n<text x=\"" + short_number(kLeft) + "\" y=\"38\">" + escaped(sentence(curve)) + "</text>\n<text x=\"" +
      short_number(kLeft) + "\" y=\"53\">" + second_sentence(curve) + "</text>\n";
  svg += grid(x, y, curve.is_counted);
  LabelPlaces places;
  svg += legend(methods_of(curve), places);
  if (curve.floor > 0) svg += floor_line(y.at(curve.floor), places);
  const std::vector<bool> front = retarget::pareto_front(curve.rows, time);
  std::vector<std::size_t> order;
  for (std::size_t k = 0; k < curve.rows.size(); ++k) {
    if (front[k]) order.push_back(k);
  }
  std::sort(order.begin(), order.end(),
            [&](std::size_t a, std::size_t b) { return curve.rows[a].*time < curve.rows[b].*time; });
  std::string line;
  for (const std::size_t k : order) {
    line += short_number(x.at(curve.rows[k].*time), 5) + "," + short_number(y.at(curve.rows[k].error_rel_length), 5) + " ";
  }
  svg += "<polyline fill=\"none\" stroke=\"#000\" stroke-opacity=\"0.5\" points=\"" + line + "\"/>\n";
  for (std::size_t k = 0; k < curve.rows.size(); ++k) {
    const AccuracyRow& row = curve.rows[k];
    const double left = x.at(row.*time), top = y.at(row.error_rel_length), half = static_cast<int>(k) == curve.recommended ? kRing : kMark;
    if (row.stable || row.falls) places.take({left - half, top - half, left + half, top + half});
  }
  for (std::size_t k = 0; k < curve.rows.size(); ++k) {
    const AccuracyRow& row = curve.rows[k];
    if (row.falls) svg += fallen(row, x.at(row.*time), y.at(row.error_rel_length), places);
    if (!row.stable) continue;
    const std::string at =
        "cx=\"" + short_number(x.at(row.*time), 5) + "\" cy=\"" + short_number(y.at(row.error_rel_length), 5) + "\"";
    svg += (has_links ? "<a href=\"#row" + std::to_string(k) + "\">" : std::string("<g>")) + "<title>" +
           escaped(name_of(row)) + ": " + percent(row.error_rel_length) + " of L, " + short_number(row.*time) +
           " ms a second" + (row.is_refused ? row.breaking.pieces > 0 ? ", refused for breaking otherwise" : ", refused by its closed loop" : "") + "</title>";
    if (static_cast<int>(k) == curve.recommended)
      svg += "<circle " + at + " r=\"10\" fill=\"none\" stroke=\"#000\" stroke-width=\"2\"/>";
    const bool is_box = row.element == "hex" || row.element == "quad";
    svg += "<circle " + at + " r=\"" + (front[k] ? "5" : "4") + "\" stroke=\"" + colour_of(row.method) +
           "\" stroke-width=\"1.5\" fill=\"" + (is_box ? "#fff" : colour_of(row.method)) + "\" fill-opacity=\"" +
           (front[k] ? "1" : "0.5") + "\"/>" + (row.is_refused ? cross(x.at(row.*time), y.at(row.error_rel_length)) : "") + (has_links ? "</a>\n" : "</g>\n");
  }
  return svg + "</svg>\n";
}

}  // namespace

std::string accuracy_svg(const AccuracyCurve& curve) { return diagram(curve, false); }

std::string accuracy_page(const AccuracyCurve& curve) {
  std::string html =
      "<!DOCTYPE html>\n<html lang=\"en\"><meta charset=\"utf-8\"><title>Accuracy against "
      "time</title>\n<style>body{font:14px "
      "sans-serif;max-width:1180px;margin:2em auto;padding:0 "
      "1em}svg{width:900px;max-width:100%}table{border-collapse:collapse;display:block;overflow-x:auto}"
      "th,td{border:1px solid #ccc;padding:.25em "
      ".5em;text-align:right}tr:target{background:#fe9}.chosen{font-weight:bold}a{cursor:"
      "pointer}</style>\n<h1>Accuracy against time: " +
      escaped(curve.subject) + "</h1>\n<p>" + escaped(curve.truth) + " No error below " + percent(curve.floor) +
      " of L can be told by it. A click on a point leads to its row; empty points are of hexahedra or quads. " +
      (curve.is_counted ? "The picture shows counted work, which is the same on every machine, and the choice goes by it."
                        : "Picture and ring go by this machine's processor time; choices (--max-error) go by counted work, which is the same "
                          "on every machine.") +
      "</p>\n";
  return html + diagram(curve, true) + table(curve, retarget::pareto_front(curve.rows, time_of(curve))) + "</html>\n";
}

std::string accuracy_json(const AccuracyCurve& curve) {
  nlohmann::ordered_json json;
  json["schema"] = "hydrostat.accuracy/1";
  json["subject"] = curve.subject;
  json["truth"] = curve.truth;
  json["max_error"] = curve.max_error;
  json["floor"] = curve.floor;
  json["recommended"] = curve.recommended;
  json["rows"] = nlohmann::ordered_json::array();
  const std::vector<bool> front = retarget::pareto_front(curve.rows, time_of(curve));
  for (std::size_t k = 0; k < curve.rows.size(); ++k) {
    const AccuracyRow& row = curve.rows[k];
    json["rows"].push_back({{"method", row.method},
                            {"element", row.element},
                            {"material", row.material},
                            {"nodes", row.nodes},
                            {"dt_s", row.dt_s},
                            {"iterations", row.iterations},
                            {"harmonics", row.harmonics},
                            {"error_rms_m", row.error_rms_m},
                            {"error_rel_length", row.error_rel_length},
                            {"ms_per_sim_s", row.ms_per_sim_s},
                            {"work_ms", row.work_ms},
                            {"volume_error", row.volume_error},
                            {"momentum_error", row.momentum_error},
                            {"angular_error", row.angular_error},
                            {"stable", row.stable},
                            {"falls", row.falls},
                            {"loop_error_m", row.loop_error_m >= 0 ? nlohmann::ordered_json(row.loop_error_m) : nlohmann::ordered_json()},
                            {"refused", row.is_refused},
                            {"on_front", static_cast<bool>(front[k])}});
  }
  return json.dump(1) + "\n";
}

}  // namespace hydrostat::io
