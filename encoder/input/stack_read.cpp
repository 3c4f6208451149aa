// JSON description -> data set.
#include "encoder/input/stack_read.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <initializer_list>
#include <optional>
#include <string_view>

#include "encoder/input/directory_files.h"
#include "encoder/input/image_list.h"
#include "encoder/input/image_placement.h"
#include "encoder/input/json_members.h"
#include "encoder/output/atomic_file.h"

namespace btfc {
namespace {

using Json = nlohmann::json;

std::optional<std::vector<double>> finite_numbers(const Json& value, std::size_t count) {
  if (!value.is_array() || value.size() != count) return std::nullopt;
  std::vector<double> out;
  for (const Json& each : value) {
    if (!each.is_number() || !std::isfinite(each.get<double>())) return std::nullopt;
    out.push_back(each.get<double>());
  }
  return out;
}

// "view" or "view_vector" of an image; `where` names it in errors.
Result<GridDirection> direction_in(const Json& image, const std::string& key, const std::string& where) {
  const std::string vector_key = key + "_vector";
  const auto angles = image.find(key), vector = image.find(vector_key);
  if ((angles == image.end()) == (vector == image.end())) {
    return bad_data(fmt::format("{} has {} of '{}' and '{}', expected one", where,
                                angles == image.end() ? "none" : "both", key, vector_key));
  }
  if (angles != image.end()) {
    const auto numbers = finite_numbers(*angles, 2);
    const auto found = numbers && (*numbers)[0] >= 0 ? grid_direction((*numbers)[0], (*numbers)[1])
                                                     : std::optional<GridDirection>();
    if (found) return *found;
    return bad_data(
        fmt::format("{} has a wrong '{}', expected [theta, phi] in degrees, theta 0 to 90", where, key));
  }
  const auto numbers = finite_numbers(*vector, 3);
  const auto found = numbers ? grid_direction(Vector3{(*numbers)[0], (*numbers)[1], (*numbers)[2]})
                             : std::optional<GridDirection>();
  if (found) return *found;
  return bad_data(fmt::format("{} has a wrong '{}', expected [x, y, z] longer than 0.0001, z not below 0",
                              where, vector_key));
}

Result<PlacedImage> image_in(const Json& image, const std::filesystem::path& folder,
                             const std::string& where) {
  if (!image.is_object()) return bad_data(fmt::format("{} is no JSON object", where));
  if (const auto key = unknown_member(image, {"file", "view", "view_vector", "light", "light_vector"})) {
    return bad_data(fmt::format("{} has an unknown member '{}'", where, *key));
  }
  const auto file = image.find("file");
  if (file == image.end() || !file->is_string() || file->get_ref<const std::string&>().empty()) {
    return bad_data(fmt::format("{} has no 'file', expected the path of an image", where));
  }
  const Result<GridDirection> view = direction_in(image, "view", where);
  if (!view) return view.error();
  const Result<GridDirection> light = direction_in(image, "light", where);
  if (!light) return light.error();
  return PlacedImage{(folder / file->get_ref<const std::string&>()).string(), *view, *light};
}

// The conventions beside the images.
Result<DatasetInfo> conventions_in(const Json& root, const std::string& path) {
  DatasetInfo info;
  if (const auto at = root.find("colour_space"); at != root.end()) {
    const auto space =
        at->is_string() ? colour_space_of(at->get_ref<const std::string&>()) : std::optional<ColourSpace>();
    if (!space) {
      return bad_data(
          fmt::format("'{}' has a wrong 'colour_space', expected a name such as srgb_rec709_scene", path));
    }
    info.colour_space = *space;
  }
  if (const auto at = root.find("quantity"); at != root.end()) {
    const auto quantity =
        at->is_string() ? quantity_of(at->get_ref<const std::string&>()) : std::optional<Quantity>();
    if (!quantity) {
      return bad_data(fmt::format(
          "'{}' has a wrong 'quantity', expected unspecified, reflectance, reflectance_cos, radiance or data",
          path));
    }
    info.quantity = *quantity;
  }
  if (const auto at = root.find("wraps"); at != root.end()) {
    if (!at->is_boolean()) {
      return bad_data(fmt::format("'{}' has a wrong 'wraps', expected true or false", path));
    }
    info.wraps = at->get<bool>();
  }
  return info;
}

}  // namespace

bool is_stack(const std::string& path) {
  std::error_code unknown;
  return file_extension(path) == "json" && std::filesystem::is_regular_file(path, unknown);
}

Result<DatasetRead> read_stack(const std::string& path, const DatasetReadOptions& options) {
  const Result<Bytes> text = read_file(path);
  if (!text) return text.error();
  const Json root = Json::parse(text->begin(), text->end(), nullptr, false);
  if (!root.is_object()) return bad_data(fmt::format("'{}' is no JSON object", path));
  if (const auto key = unknown_member(root, {"images", "colour_space", "quantity", "wraps"})) {
    return bad_data(fmt::format("'{}' has an unknown member '{}'", path, *key));
  }
  Result<DatasetInfo> info = conventions_in(root, path);
  if (!info) return info.error();
  const auto listed = root.find("images");
  if (listed == root.end() || !listed->is_array() || listed->empty()) {
    return bad_data(fmt::format("'{}' has no 'images', expected an array of at least one", path));
  }
  const std::filesystem::path folder = std::filesystem::path(path).parent_path();
  std::vector<PlacedImage> images;
  for (std::size_t i = 0; i < listed->size(); ++i) {
    Result<PlacedImage> image = image_in((*listed)[i], folder, fmt::format("'{}' images[{}]", path, i));
    if (!image) return image.error();
    images.push_back(std::move(*image));
  }
  const Result<Placement> placement = place(images);
  if (!placement) return placement.error();
  store_placement(*placement, images, *info);
  std::vector<std::string> paths;
  for (const PlacedImage& image : images) paths.push_back(image.path);
  Result<Dataset> dataset = dataset_of_images(std::move(*info), paths, options);
  if (!dataset) return dataset.error();
  std::vector<std::string> notes;
  if (placement->missing > 0) {
    notes.push_back(fmt::format("{} pairs of a view and a light have no image, the first: {}",
                                placement->missing, placement->first_missing));
  }
  const std::size_t images_read = dataset->info().pairs.size();
  return DatasetRead{std::move(*dataset), images_read, "stack", std::move(notes)};
}

}  // namespace btfc
