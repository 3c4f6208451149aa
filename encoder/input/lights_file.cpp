// Text -> light directions.
#include "encoder/input/lights_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <string_view>

#include "encoder/input/text_numbers.h"

namespace btfc {
namespace {

constexpr std::size_t kMaxLights = 10000;

Result<Done> check_count(const std::string& path, std::size_t count) {
  if (count >= 1 && count <= kMaxLights) return Done{};
  return bad_data(fmt::format("'{}' lists {} lights, expected 1 to {}", path, count, kMaxLights));
}

Result<Direction> direction_of_light(const std::string& path, std::size_t number, const Vector3& v) {
  const double length = std::hypot(v[0], v[1], v[2]);
  const auto wrong = [&](const char* what) {
    return bad_data(fmt::format("'{}' light {} is ({}, {}, {}), {}", path, number, v[0], v[1], v[2], what));
  };
  if (!(length >= 1e-4) || !std::isfinite(length)) return wrong("expected a vector longer than 0.0001");
  if (v[2] < 0) return wrong("below the surface; expected z of 0 or more");
  return direction_from_vector(v);
}

// Chords of unit vectors stand in for angles: n^2 comparisons without a trigonometric function.
Result<Done> check_distinct(const std::string& path, const std::vector<Direction>& lights) {
  std::vector<Vector3> units;
  for (const Direction& d : lights) units.push_back(unit_vector(d));
  for (std::size_t i = 0; i < units.size(); ++i) {
    for (std::size_t j = 0; j < i; ++j) {
      const double x = units[i][0] - units[j][0], y = units[i][1] - units[j][1],
                   z = units[i][2] - units[j][2];
      if (x * x + y * y + z * z < 1e-9 && same_direction(lights[i], lights[j])) {
        return bad_data(fmt::format("'{}' has the light {} twice, as light {} and {}", path,
                                    to_text(lights[i]), j + 1, i + 1));
      }
    }
  }
  return Done{};
}

Result<LightList> light_list(const std::string& path, const std::vector<Vector3>& vectors,
                             std::vector<std::string> names) {
  LightList out;
  for (const Vector3& v : vectors) {
    const Result<Direction> direction = direction_of_light(path, out.directions.size() + 1, v);
    if (!direction) return direction.error();
    out.directions.push_back(*direction);
  }
  if (const auto good = check_distinct(path, out.directions); !good) return good.error();
  out.names = std::move(names);
  return out;
}

// "some name.jpg 0.1 0.2 0.97": the last three words are numbers, the rest is the name.
bool split_line(std::string_view line, std::string& name, Vector3& v) {
  const std::vector<std::string_view> words = words_of(line);
  if (words.size() < 3) return false;
  for (std::size_t c = 0; c < 3; ++c) {
    const auto number = number_of(words[words.size() - 3 + c]);
    if (!number) return false;
    v[c] = *number;
  }
  std::string_view rest =
      line.substr(0, static_cast<std::size_t>(words[words.size() - 3].data() - line.data()));
  const std::size_t end = rest.find_last_not_of(" \t,;");
  rest = end == std::string_view::npos ? std::string_view() : rest.substr(0, end + 1);
  rest.remove_prefix(std::min(rest.size(), rest.find_first_not_of(" \t")));
  name = rest;
  return true;
}

bool near_unit(const Vector3& v) { return std::fabs(std::hypot(v[0], v[1], v[2]) - 1) < 0.02; }

// Rows of x y z, or the three rows of all x, y, z: a table of three by three is what has unit vectors, and
// rows where both have.
std::vector<Vector3> vectors_of(const std::vector<std::vector<double>>& rows) {
  std::vector<Vector3> by_rows, by_columns;
  for (const auto& row : rows) {
    if (row.size() == 3) by_rows.push_back({row[0], row[1], row[2]});
  }
  if (rows.size() == 3 && rows[0].size() == rows[1].size() && rows[0].size() == rows[2].size()) {
    for (std::size_t i = 0; i < rows[0].size(); ++i)
      by_columns.push_back({rows[0][i], rows[1][i], rows[2][i]});
  }
  if (by_rows.size() != rows.size()) return by_columns;
  const bool columns = by_columns.size() == 3 && !std::all_of(by_rows.begin(), by_rows.end(), near_unit) &&
                       std::all_of(by_columns.begin(), by_columns.end(), near_unit);
  return columns ? by_columns : by_rows;
}

}  // namespace

Result<LightList> read_lp(const std::string& path) {
  const Result<std::vector<std::string>> lines = read_lines(path);
  if (!lines) return lines.error();
  std::size_t at = 0;
  while (at < lines->size() && words_of((*lines)[at]).empty()) ++at;
  const auto first = at < lines->size() ? words_of((*lines)[at]) : std::vector<std::string_view>();
  const std::optional<double> count = first.size() == 1 ? number_of(first[0]) : std::nullopt;
  if (!count || *count != std::floor(*count)) {
    return bad_data(fmt::format("'{}' begins with '{}', expected the number of images", path,
                                at < lines->size() ? (*lines)[at].substr(0, 40) : std::string("nothing")));
  }
  std::vector<Vector3> vectors;
  std::vector<std::string> names;
  std::size_t unnamed = 0;
  for (++at; at < lines->size(); ++at) {
    if (words_of((*lines)[at]).empty()) continue;
    std::string name;
    Vector3 v{};
    if (!split_line((*lines)[at], name, v)) {
      return bad_data(fmt::format("'{}' line {} is '{}', expected a name and three numbers", path, at + 1,
                                  (*lines)[at].substr(0, 80)));
    }
    unnamed += name.empty() ? 1 : 0;
    vectors.push_back(v);
    names.push_back(std::move(name));
  }
  if (static_cast<double>(vectors.size()) != *count) {
    return bad_data(fmt::format("'{}' says {} images and lists {}", path, *count, vectors.size()));
  }
  if (const auto good = check_count(path, vectors.size()); !good) return good.error();
  if (unnamed > 0 && unnamed < names.size()) {
    return bad_data(fmt::format("'{}' names {} of its {} images, expected all or none", path,
                                names.size() - unnamed, names.size()));
  }
  if (unnamed > 0) names.clear();
  return light_list(path, vectors, std::move(names));
}

Result<LightList> read_light_table(const std::string& path) {
  const Result<std::vector<std::string>> lines = read_lines(path);
  if (!lines) return lines.error();
  auto rows = number_rows(*lines);
  const bool counted = rows && rows->size() > 1 && (*rows)[0].size() == 1;
  if (counted && (*rows)[0][0] != static_cast<double>(rows->size() - 1)) {
    return bad_data(fmt::format("'{}' says {} lights and lists {}", path, (*rows)[0][0], rows->size() - 1));
  }
  if (counted) rows->erase(rows->begin());
  const std::vector<Vector3> vectors = rows ? vectors_of(*rows) : std::vector<Vector3>();
  if (vectors.empty()) {
    return bad_data(
        fmt::format("'{}' is no table of lights, expected x y z a line or three lines of x, y and z", path));
  }
  if (const auto good = check_count(path, vectors.size()); !good) return good.error();
  return light_list(path, vectors, {});
}

Result<std::vector<std::vector<double>>> read_light_intensities(const std::string& path, std::size_t lights) {
  const Result<std::vector<std::string>> lines = read_lines(path);
  if (!lines) return lines.error();
  auto rows = number_rows(*lines);
  bool good = rows && rows->size() == lights;
  for (std::size_t i = 0; good && i < rows->size(); ++i) {
    const auto& row = (*rows)[i];
    good = row.size() == (*rows)[0].size() &&
           std::all_of(row.begin(), row.end(), [](double v) { return v > 0; });
  }
  if (!good) {
    return bad_data(
        fmt::format("'{}' is no list of intensities, expected {} lines of numbers above 0", path, lights));
  }
  return *std::move(rows);
}

}  // namespace btfc
