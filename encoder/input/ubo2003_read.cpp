// Image names -> directions and pairs -> data set.
#include "encoder/input/ubo2003_read.h"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <map>

#include "encoder/input/directory_files.h"
#include "encoder/input/image_list.h"
#include "encoder/input/image_placement.h"
#include "encoder/input/text_numbers.h"
#include "encoder/input/ubo2003_name.h"
#include "encoder/input/wavelengths.h"

namespace btfc {
namespace {

// Entries that is_ubo2003 looks at: real sets have an image among the first few.
constexpr std::size_t kLookedAt = 20000;

// What lies in and below the directory.
struct Listing {
  std::vector<PlacedImage> images;
  std::vector<std::string> texts;
  std::size_t others = 0;  // files that are neither
};

Result<Listing> list_images(const std::string& path) {
  const Result<std::vector<std::string>> files = files_of_directory(path, true);
  if (!files) return files.error();
  Listing out;
  for (const std::string& file : *files) {
    const auto angles =
        is_texture_file(file) ? ubo2003_angles(file_stem(file)) : std::optional<Ubo2003Angles>();
    if (!angles) {
      const bool text = file_extension(file) == "txt";
      if (text) out.texts.push_back(file);
      out.others += text ? 0 : 1;
      continue;
    }
    const auto view = grid_direction(angles->view_theta, angles->view_phi);
    const auto light = grid_direction(angles->light_theta, angles->light_phi);
    if (!view || !light) {
      return bad_data(
          fmt::format("the name of '{}' has theta {} for the view and {} for the light, expected -90 to 90",
                      file, angles->view_theta, angles->light_theta));
    }
    out.images.push_back({file, *view, *light});
  }
  if (out.images.empty()) {
    return bad_data(
        fmt::format("'{}' has no image whose name says tl, pl, tv and pv, expected names as "
                    "'00001 tl015 pl060 tv030 pv000.jpg'",
                    path));
  }
  return out;
}

using Shifts = std::map<GridDirection, GridDirection>;

// The rows of a list of shifted lights; empty where the text is none.
Result<Shifts> shifts_of(const std::string& path) {
  const Result<std::vector<std::string>> lines = read_lines(path);
  if (!lines) return lines.error();
  const auto rows = number_rows(*lines);
  Shifts shifts;
  if (!rows || !std::all_of(rows->begin(), rows->end(), [](const auto& row) { return row.size() == 5; })) {
    return shifts;
  }
  for (const std::vector<double>& row : *rows) {
    const auto nominal = grid_direction(row[1], row[2]), shifted = grid_direction(row[3], row[4]);
    if (!nominal || !shifted) {
      return bad_data(
          fmt::format("'{}' row {} has theta {} and {}, expected -90 to 90", path, row[0], row[1], row[3]));
    }
    if (const auto [at, fresh] = shifts.emplace(*nominal, *shifted); !fresh && at->second != *shifted) {
      return bad_data(fmt::format("'{}' shifts the light {} twice, to {} and {}", path,
                                  to_text(direction_of(*nominal)), to_text(direction_of(at->second)),
                                  to_text(direction_of(*shifted))));
    }
  }
  return shifts;
}

// Moves the lights that coincide with their view; how many.
Result<std::size_t> shift_lights(const std::vector<std::string>& texts, std::vector<PlacedImage>& images) {
  Shifts shifts;
  std::string from;
  for (const std::string& text : texts) {
    Result<Shifts> found = shifts_of(text);
    if (!found) return found.error();
    if (found->empty()) continue;
    if (!from.empty()) {
      return bad_data(
          fmt::format("'{}' and '{}' are both lists of shifted lights, expected one", from, text));
    }
    from = text;
    shifts = std::move(*found);
  }
  std::size_t moved = 0;
  for (PlacedImage& image : images) {
    const auto shift = shifts.find(image.light);
    if (image.view != image.light || shift == shifts.end() || shift->second == image.light) continue;
    image.light = shift->second;
    ++moved;
  }
  return moved;
}

// CIE XYZ under D65 -> linear Rec. 709: the inverse of the matrix of primaries in ITU-R BT.709 with the white
// (0.3127, 0.3290), Y of white is 1.
constexpr double kRec709OfXyz[3][3] = {{3.2409699419, -1.5373831776, -0.4986107603},
                                       {-0.9692436363, 1.8759675015, 0.0415550574},
                                       {0.0556300797, -0.2039769589, 1.0569715142}};

Result<Done> to_rec709(const std::string& path, Image& image) {
  for (std::size_t t = 0; t < image.codes.size(); t += 3) {
    double xyz[3];
    for (std::size_t c = 0; c < 3; ++c) xyz[c] = code_value(image.type, image.codes[t + c]);
    for (std::size_t c = 0; c < 3; ++c) {
      const auto& row = kRec709OfXyz[c];
      const double value = row[0] * xyz[0] + row[1] * xyz[1] + row[2] * xyz[2];
      const std::optional<std::uint16_t> code = finite_half(static_cast<float>(value));
      if (!code) {
        return bad_data(fmt::format("'{}' has the colour XYZ ({}, {}, {}) at ({}, {}), beyond 65504 in RGB",
                                    path, xyz[0], xyz[1], xyz[2], t / 3 % image.width, t / 3 / image.width));
      }
      image.codes[t + c] = *code;
    }
  }
  image.colour_space = ColourSpace::lin_rec709_scene;
  return Done{};
}

// UTIA's EXR, or three channels that are called X, Y, Z; a file that states its primaries is believed.
bool holds_xyz(const std::string& path, const ImageFile& named) {
  const Image& image = named.image;
  if (image.channels != 3 || image.type != SampleType::float16 || image.colour_space != ColourSpace::unknown)
    return false;
  if (named.channels == std::vector<std::string>{"X", "Y", "Z"}) return true;
  return file_extension(path) == "exr" && is_utia_name(file_stem(path)) &&
         wavelengths_of(named.channels).empty();
}

}  // namespace

bool is_ubo2003(const std::string& path) {
  return is_directory(path) && any_file_below(path, kLookedAt, [](const std::string& file) {
           return is_texture_file(file) && ubo2003_angles(file_stem(file)).has_value();
         });
}

Result<DatasetRead> read_ubo2003(const std::string& path, const DatasetReadOptions& options) {
  Result<Listing> listing = list_images(path);
  if (!listing) return listing.error();
  std::vector<PlacedImage>& images = listing->images;
  std::vector<std::string> notes;
  if (listing->others > 0) {
    notes.push_back(fmt::format("{} files that are no such images were passed over", listing->others));
  }

  Result<Placement> placement = place(images);
  if (!placement) return placement.error();
  if (placement->missing > 0) {
    const std::string text =
        fmt::format("{} of {} images are missing in '{}', the first: {}", placement->missing,
                    placement->views.size() * placement->lights.size(), path, placement->first_missing);
    if (!options.skip_missing) return bad_data(text + "; expected every light for every view");
    notes.push_back(text);
  }
  const Result<std::size_t> moved = shift_lights(listing->texts, images);
  if (!moved) return moved.error();
  if (*moved > 0) {
    notes.push_back(fmt::format("{} images have a light shifted away from the view", *moved));
    placement = place(images);
    if (!placement) return placement.error();
  }

  DatasetInfo info;
  store_placement(*placement, images, info);
  std::vector<std::string> paths;
  for (const PlacedImage& image : images) paths.push_back(image.path);
  std::atomic<bool> converted{false};
  Result<Dataset> dataset = dataset_of_images(std::move(info), paths, options,
                                              [&](std::size_t number, ImageFile& named) -> Result<Done> {
                                                if (!holds_xyz(paths[number], named)) return Done{};
                                                converted.store(true, std::memory_order_relaxed);
                                                named.channels = {"R", "G", "B"};
                                                return to_rec709(paths[number], named.image);
                                              });
  if (!dataset) return dataset.error();
  if (converted.load()) notes.push_back("the images hold CIE XYZ under D65, converted to linear Rec. 709");
  const std::size_t images_read = dataset->info().pairs.size();
  return DatasetRead{std::move(*dataset), images_read, "ubo2003", std::move(notes)};
}

}  // namespace btfc
