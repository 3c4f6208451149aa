// Light list and photographs -> data set.
#include "encoder/input/lights_read.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>

#include "encoder/input/directory_files.h"
#include "encoder/input/image_list.h"
#include "encoder/input/lights_file.h"
#include "encoder/input/text_numbers.h"

namespace btfc {
namespace {

bool is_file(const std::string& path) {
  std::error_code unknown;
  return std::filesystem::is_regular_file(path, unknown);
}

std::string inside(const std::string& directory, const char* name) {
  return (std::filesystem::path(directory) / name).string();
}

std::string parent_of(const std::string& path) {
  const std::string parent = std::filesystem::path(path).parent_path().string();
  return parent.empty() ? "." : parent;
}

bool is_lp(const std::string& path) { return file_extension(path) == "lp"; }

struct Source {
  std::string directory;  // of the images
  std::string lights;     // the file of lights
};

// Tables of lights: of this directory, or of the one above for all objects in it.
std::optional<std::string> light_table(const std::string& directory) {
  const std::string above = inside(directory, "..");
  for (const std::string& place : {directory, above}) {
    for (const char* name : {"light_directions.txt", "lights.txt"}) {
      if (is_file(inside(place, name))) return inside(place, name);
    }
  }
  return std::nullopt;
}

Result<Source> find_source(const std::string& path) {
  if (!is_directory(path)) return Source{parent_of(path), path};
  const Result<std::vector<std::string>> files = files_of_directory(path, false);
  if (!files) return files.error();
  Source out{path, ""};
  for (const std::string& file : *files) {
    if (!is_lp(file)) continue;
    if (!out.lights.empty()) {
      return bad_data(
          fmt::format("'{}' and '{}' are both lists of lights, expected the path of one", out.lights, file));
    }
    out.lights = file;
  }
  if (out.lights.empty()) out.lights = light_table(path).value_or("");
  if (out.lights.empty()) return bad_data(fmt::format("'{}' has no file of lights", path));
  return out;
}

struct Photographs {
  std::vector<std::string> paths;  // in natural order
  std::size_t masks = 0;
};

Result<Photographs> photographs_in(const std::string& directory) {
  const Result<std::vector<std::string>> files = files_of_directory(directory, false);
  if (!files) return files.error();
  Photographs out;
  for (const std::string& file : *files) {
    if (!is_photograph_file(file)) continue;
    if (lower_case(file_stem(file)).find("mask") != std::string::npos) {
      ++out.masks;
    } else {
      out.paths.push_back(file);
    }
  }
  std::sort(out.paths.begin(), out.paths.end(), natural_less);
  return out;
}

// Behind the last / or \: lists are often written on Windows with full paths.
std::string base_name(const std::string& name) { return name.substr(name.find_last_of("/\\") + 1); }

// paths[i]: the image of light i, or empty.
using Matched = std::vector<std::string>;

// An image by its exact name, else by its name in any case where only one has it.
Matched match_names(const std::vector<std::string>& names, const Photographs& photographs) {
  std::map<std::string, std::string> exact;
  std::multimap<std::string, std::string> any_case;
  for (const std::string& path : photographs.paths) {
    exact[file_name(path)] = path;
    any_case.emplace(lower_case(file_name(path)), path);
  }
  Matched out;
  for (const std::string& name : names) {
    const std::string base = base_name(name), lower = lower_case(base);
    const auto found = exact.find(base);
    if (found != exact.end()) {
      out.push_back(found->second);
    } else {
      out.push_back(any_case.count(lower) == 1 ? any_case.find(lower)->second : "");
    }
  }
  return out;
}

Error no_match(const Source& source, const Photographs& photographs, std::size_t lights) {
  return bad_data(fmt::format("'{}' has {} lights and '{}' has {} images, expected as many", source.lights,
                              lights, source.directory, photographs.paths.size()));
}

// The images of the lights, and a note on how they were found.
Result<Matched> match(const Source& source, const LightList& list, const Photographs& photographs,
                      bool skip_missing, std::vector<std::string>& notes) {
  const std::size_t lights = list.directions.size();
  const Matched named = match_names(list.names, photographs);
  const auto missing = static_cast<std::size_t>(std::count(named.begin(), named.end(), std::string()));
  if (missing == named.size()) {  // no names, or none of them here
    if (photographs.paths.size() != lights) return no_match(source, photographs, lights);
    notes.push_back(fmt::format("the {} images were taken in the order of their names", lights));
    return photographs.paths;
  }
  std::map<std::string, std::size_t> light_of;
  for (std::size_t i = 0; i < named.size(); ++i) {
    if (named[i].empty()) continue;
    if (const auto [at, fresh] = light_of.emplace(named[i], i); !fresh) {
      return bad_data(fmt::format("'{}' is the image of light {} and {} in '{}'", named[i], at->second + 1,
                                  i + 1, source.lights));
    }
  }
  if (missing == 0) return named;
  const auto at =
      static_cast<std::size_t>(std::find(named.begin(), named.end(), std::string()) - named.begin());
  const std::string text = fmt::format("{} of {} images of '{}' are missing, the first: '{}' of light {}",
                                       missing, lights, source.lights, base_name(list.names[at]), at + 1);
  if (!skip_missing) return bad_data(text + fmt::format("; expected them in '{}'", source.directory));
  notes.push_back(text);
  return named;
}

// The list's own names, else those of filenames.txt (DiLiGenT), one a line.
Result<LightList> light_list_of(const Source& source) {
  Result<LightList> list = is_lp(source.lights) ? read_lp(source.lights) : read_light_table(source.lights);
  const std::string path = inside(source.directory, "filenames.txt");
  if (!list || is_lp(source.lights) || !is_file(path)) return list;
  const Result<std::vector<std::string>> lines = read_lines(path);
  if (!lines) return lines.error();
  for (const std::string& line : *lines) {
    if (!words_of(line).empty()) list->names.push_back(line.substr(0, line.find_last_not_of(" \t") + 1));
  }
  if (list->names.size() != list->directions.size()) {
    return bad_data(fmt::format("'{}' names {} images for the {} lights of '{}'", path, list->names.size(),
                                list->directions.size(), source.lights));
  }
  return list;
}

// Samples over the light's intensity in their channel, as halves.
Result<Done> divide(const std::string& path, const std::vector<double>& intensities, Image& image) {
  if (intensities.size() != image.channels) {
    return bad_data(fmt::format("'{}' has {} channels, and its light has {} intensities", path,
                                image.channels, intensities.size()));
  }
  for (std::size_t i = 0; i < image.codes.size(); ++i) {
    const double value = code_value(image.type, image.codes[i]) / intensities[i % image.channels];
    const std::optional<std::uint16_t> code = finite_half(static_cast<float>(value));
    if (!code) {
      return bad_data(fmt::format("'{}' divided by its light's intensity is {}, beyond 65504", path, value));
    }
    image.codes[i] = *code;
  }
  image.type = SampleType::float16;
  image.colour_space = ColourSpace::lin_rec709_scene;
  return Done{};
}

}  // namespace

bool is_lights(const std::string& path) {
  if (!is_directory(path)) return is_lp(path) && is_file(path);
  const Result<std::vector<std::string>> files = files_of_directory(path, false);
  if (!files) return false;
  if (std::any_of(files->begin(), files->end(), is_lp)) return true;
  return std::any_of(files->begin(), files->end(), is_photograph_file) && light_table(path).has_value();
}

Result<DatasetRead> read_lights(const std::string& path, const DatasetReadOptions& options) {
  const Result<Source> source = find_source(path);
  if (!source) return source.error();
  const Result<LightList> list = light_list_of(*source);
  if (!list) return list.error();
  const Result<Photographs> photographs = photographs_in(source->directory);
  if (!photographs) return photographs.error();
  std::vector<std::string> notes;
  if (photographs->masks > 0)
    notes.push_back(fmt::format("{} mask images were passed over", photographs->masks));
  const Result<Matched> matched = match(*source, *list, *photographs, options.skip_missing, notes);
  if (!matched) return matched.error();

  std::vector<std::vector<double>> intensities;
  const std::string intensity_file = inside(source->directory, "light_intensities.txt");
  if (is_file(intensity_file)) {
    Result<std::vector<std::vector<double>>> rows =
        read_light_intensities(intensity_file, list->directions.size());
    if (!rows) return rows.error();
    intensities = *std::move(rows);
    notes.push_back("the samples are divided by their lights' intensities and are linear halves");
  }

  DatasetInfo info;
  info.quantity = Quantity::reflectance_cos;
  info.views = {Direction{}};
  std::vector<std::string> paths;
  std::vector<std::size_t> light_of;  // number in the list of lights
  for (std::size_t i = 0; i < matched->size(); ++i) {
    if ((*matched)[i].empty()) continue;
    info.lights.push_back(list->directions[i]);
    paths.push_back((*matched)[i]);
    light_of.push_back(i);
  }
  make_full_product(info);
  ImageEdit edit;
  if (!intensities.empty()) {
    edit = [&](std::size_t number, ImageFile& named) {
      return divide(paths[number], intensities[light_of[number]], named.image);
    };
  }
  Result<Dataset> dataset = dataset_of_images(std::move(info), paths, options, edit);
  if (!dataset) return dataset.error();
  const std::size_t images_read = dataset->info().pairs.size();
  return DatasetRead{std::move(*dataset), images_read, "lights", std::move(notes)};
}

}  // namespace btfc
