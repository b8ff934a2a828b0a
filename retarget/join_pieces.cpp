#include "retarget/join_pieces.h"

#include <algorithm>
#include <limits>
#include <map>
#include <queue>

#include "retarget/disjoint_sets.h"

namespace hydrostat::retarget {
namespace {

/// Face-connected pieces of the kept parts: for each part a part that names its piece.
std::vector<int> find_pieces(const BodyParts& body) {
  DisjointSets sets(body.count());
  for (const Link& link : body.links) {
    if (at(body.parts, link.low).kept && at(body.parts, link.high).kept) sets.join(link.low, link.high);
  }
  for (const auto& [a, b] : body.merges) sets.join(a, b);
  std::vector<int> piece(body.parts.size());
  for (std::size_t p = 0; p < piece.size(); ++p) piece[p] = sets.root(static_cast<int>(p));
  return piece;
}

/// The cheapest way from one piece to any other: through parts that are there at next to nothing, through empty cells at 1
/// to 2 each, the fuller the cheaper. Stops are parts, or the number of parts plus the index of an empty cell.
std::vector<int> cheapest_way(const Grid& cells, const BodyParts& body, const std::vector<int>& piece, int from) {
  const int part_count = body.count();
  std::vector<std::vector<int>> parts_in(static_cast<std::size_t>(cells.count()));
  std::vector<double> dropped_fill(parts_in.size(), 0);
  for (int p = 0; p < part_count; ++p) {
    const Part& part = at(body.parts, p);
    if (part.kept)
      at(parts_in, part.cell).push_back(p);
    else
      at(dropped_fill, part.cell) += part.fill;
  }
  std::vector<double> cost(static_cast<std::size_t>(part_count + cells.count()), std::numeric_limits<double>::infinity());
  std::vector<int> before(cost.size(), kNone);
  std::priority_queue<std::pair<double, int>, std::vector<std::pair<double, int>>, std::greater<>> front;
  auto offer = [&](int stop, double price, int previous) {
    if (price >= at(cost, stop)) return;
    at(cost, stop) = price;
    at(before, stop) = previous;
    front.emplace(price, stop);
  };
  for (int p = 0; p < part_count; ++p) {
    if (at(body.parts, p).kept && at(piece, p) == from) offer(p, 0, kNone);
  }
  while (!front.empty()) {
    const double price = front.top().first;
    const int stop = front.top().second;
    front.pop();
    if (price > at(cost, stop)) continue;
    if (stop < part_count && at(piece, stop) != from) {
      std::vector<int> way;
      for (int s = stop; s != kNone; s = at(before, s)) way.push_back(s);
      std::reverse(way.begin(), way.end());
      return way;
    }
    const int cell = stop < part_count ? at(body.parts, stop).cell : stop - part_count;
    for (const int mate : at(parts_in, cell)) offer(mate, price + 0.1, stop);
    for_face_neighbours(cells, cell, [&](int next) {
      for (const int part : at(parts_in, next)) offer(part, price + 0.1, stop);
      if (at(parts_in, next).empty()) offer(part_count + next, price + 2 - std::min(1.0, at(dropped_fill, next)), stop);
    });
  }
  return {};
}

/// Puts a part into each empty cell of the way, with what dropped parts fill of it. Returns their number.
int build_bridges(BodyParts& body, std::vector<int>& way) {
  const int part_count = body.count();
  for (int& stop : way) {
    if (stop < part_count) continue;
    double fill = 0;
    for (const Part& part : body.parts) fill += part.cell == stop - part_count ? part.fill : 0;
    body.parts.push_back({stop - part_count, fill});
    stop = body.count() - 1;
  }
  return body.count() - part_count;
}

/// Links the parts of a way, each to the next; two of one cell become one.
void link_way(const Grid& cells, const std::vector<int>& way, BodyParts& body) {
  for (std::size_t i = 1; i < way.size(); ++i) {
    const auto [low, high] =
        std::minmax(way[i - 1], way[i], [&](int a, int b) { return at(body.parts, a).cell < at(body.parts, b).cell; });
    const Eigen::Vector3i step = cells.place(at(body.parts, high).cell) - cells.place(at(body.parts, low).cell);
    if (step.isZero()) {
      body.merges.emplace_back(low, high);
    } else {
      body.links.insert({low, high, step[0] ? 0 : step[1] ? 1 : 2});
    }
  }
}

}  // namespace

int join_pieces(const Grid& cells, BodyParts& body) {
  int added = 0;
  for (;;) {
    const std::vector<int> piece = find_pieces(body);
    std::map<int, std::pair<double, int>> pieces;  // fill and cells
    for (std::size_t p = 0; p < piece.size(); ++p) {
      if (!body.parts[p].kept) continue;
      pieces[piece[p]].first += body.parts[p].fill;
      ++pieces[piece[p]].second;
    }
    if (pieces.size() < 2) return added;
    const auto lightest =
        std::min_element(pieces.begin(), pieces.end(), [](const auto& a, const auto& b) { return a.second < b.second; });
    std::vector<int> way = cheapest_way(cells, body, piece, lightest->first);
    const auto bridges = std::count_if(way.begin(), way.end(), [&](int stop) { return stop >= body.count(); });
    if (bridges > std::max(2, lightest->second.second)) {
      for (std::size_t p = 0; p < piece.size(); ++p) body.parts[p].kept = body.parts[p].kept && piece[p] != lightest->first;
      continue;
    }
    added += build_bridges(body, way);
    link_way(cells, way, body);
  }
}

}  // namespace hydrostat::retarget
