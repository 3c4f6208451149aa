// By OpenEXR's C interface: parts are read on many threads from one open file, and errors are values.
#include "encoder/input/btf_exr_read.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <openexr.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <map>
#include <new>
#include <numbers>
#include <numeric>

#include "encoder/for_each_index.h"
#include "encoder/input/btf_exr_names.h"
#include "encoder/input/read_selection.h"
#include "format/bytes.h"
#include "format/checked.h"
#include "format/limits.h"
#include "shaders/btfc_half.h"

namespace btfc {
namespace {

// zlib packs at most this well; a file whose images would need more is damaged.
constexpr std::uint64_t kMaxRatio = 1100;
// Of the headers, where a file's kind is looked for.
constexpr std::size_t kLookBytes = 65536;

// What OpenEXR said last on this thread: its error codes alone say little.
thread_local std::string last_message;
void keep_message(exr_const_context_t, exr_result_t, const char* message) { last_message = message; }

Error refused(const std::string& path, const std::string& message, Status status = Status::invalid_file) {
  return Error{status, fmt::format("'{}': {}", path, message), "", 0};
}

class OpenExr {
 public:
  static Result<OpenExr> open(const std::string& path) {
    struct stat found {};
    if (stat(path.c_str(), &found) != 0 || !S_ISREG(found.st_mode)) {
      return io_error(fmt::format("could not read '{}': expected a file", path));
    }
    exr_context_initializer_t init = EXR_DEFAULT_CONTEXT_INITIALIZER;
    init.error_handler_fn = keep_message;
    init.max_image_width = init.max_image_height = static_cast<int>(kMaxSide);
    init.flags = EXR_CONTEXT_FLAG_STRICT_HEADER | EXR_CONTEXT_FLAG_DISABLE_CHUNK_RECONSTRUCTION;
    OpenExr exr(path, static_cast<std::uint64_t>(found.st_size));
    last_message.clear();
    const exr_result_t result = exr_start_read(&exr.context_, path.c_str(), &init);
    if (result != EXR_ERR_SUCCESS) return exr.failed(result);
    return exr;
  }
  OpenExr(OpenExr&& other) noexcept
      : path_(std::move(other.path_)), size_(other.size_), context_(std::exchange(other.context_, nullptr)) {}
  OpenExr& operator=(OpenExr&&) = delete;
  ~OpenExr() {
    if (context_ != nullptr) exr_finish(&context_);
  }

  const std::string& path() const { return path_; }
  std::uint64_t size() const { return size_; }
  exr_const_context_t context() const { return context_; }
  Error failed(exr_result_t result) const {
    return refused(path_, last_message.empty() ? exr_get_error_code_as_string(result) : last_message);
  }

 private:
  OpenExr(std::string path, std::uint64_t size) : path_(std::move(path)), size_(size) {}
  std::string path_;
  std::uint64_t size_;
  exr_context_t context_ = nullptr;
};

// Attributes of one part; none where it is missing or of another type.
class Attributes {
 public:
  Attributes(const OpenExr& file, int part) : file_(file), part_(part) {}

  std::optional<std::int32_t> integer(const char* name) const {
    const exr_attribute_t* found = find(name, EXR_ATTR_INT);
    return found == nullptr ? std::nullopt : std::optional(found->i);
  }
  std::optional<std::string> text(const char* name) const {
    const exr_attribute_t* found = find(name, EXR_ATTR_STRING);
    if (found == nullptr) return std::nullopt;
    return std::string(found->string->str, static_cast<std::size_t>(found->string->length));
  }
  std::optional<std::vector<std::string>> texts(const char* name) const {
    const exr_attribute_t* found = find(name, EXR_ATTR_STRING_VECTOR);
    if (found == nullptr) return std::nullopt;
    std::vector<std::string> all;
    for (int i = 0; i < found->stringvector->n_strings; ++i) {
      const exr_attr_string_t& each = found->stringvector->strings[i];
      all.emplace_back(each.str, static_cast<std::size_t>(each.length));
    }
    return all;
  }
  const exr_attr_v2d_t* pair_of_doubles(const char* name) const {
    const exr_attribute_t* found = find(name, EXR_ATTR_V2D);
    return found == nullptr ? nullptr : found->v2d;
  }
  const exr_attr_v2i_t* pair_of_integers(const char* name) const {
    const exr_attribute_t* found = find(name, EXR_ATTR_V2I);
    return found == nullptr ? nullptr : found->v2i;
  }

 private:
  const exr_attribute_t* find(const char* name, exr_attribute_type_t type) const {
    const exr_attribute_t* found = nullptr;
    if (exr_get_attribute_by_name(file_.context(), part_, name, &found) != EXR_ERR_SUCCESS) return nullptr;
    return found->type == type ? found : nullptr;
  }
  const OpenExr& file_;
  int part_;
};

// How the samples of every part lie.
struct Layout {
  exr_attr_box2i_t window{};       // of the data
  std::vector<std::string> names;  // of channels, in the file's order
  exr_pixel_type_t type = EXR_PIXEL_HALF;

  std::uint32_t width() const { return static_cast<std::uint32_t>(window.max.x - window.min.x) + 1; }
  std::uint32_t height() const { return static_cast<std::uint32_t>(window.max.y - window.min.y) + 1; }
  std::size_t sample_bytes() const { return type == EXR_PIXEL_HALF ? 2 : 4; }
  bool operator==(const Layout& o) const {
    return names == o.names && type == o.type && window.min.x == o.window.min.x &&
           window.min.y == o.window.min.y && window.max.x == o.window.max.x && window.max.y == o.window.max.y;
  }
};

Result<Layout> layout_of(const OpenExr& file, int part) {
  const auto wrong = [&](const std::string& what, Status status = Status::invalid_file) {
    return refused(file.path(), fmt::format("part {} {}", part, what), status);
  };
  Layout layout;
  exr_storage_t storage = EXR_STORAGE_LAST_TYPE;
  exr_compression_t compression = EXR_COMPRESSION_LAST_TYPE;
  const exr_attr_chlist_t* channels = nullptr;
  const exr_const_context_t context = file.context();
  for (const exr_result_t result :
       {exr_get_storage(context, part, &storage), exr_get_compression(context, part, &compression),
        exr_get_channels(context, part, &channels), exr_get_data_window(context, part, &layout.window)}) {
    if (result != EXR_ERR_SUCCESS) return file.failed(result);
  }
  if (storage != EXR_STORAGE_SCANLINE) return wrong("is no image of scan lines", Status::unsupported);
  if (compression > EXR_COMPRESSION_PIZ) {
    return wrong("has a lossy compression, expected none, RLE, ZIPS, ZIP or PIZ", Status::unsupported);
  }
  const std::int64_t width = std::int64_t{layout.window.max.x} - layout.window.min.x + 1;
  const std::int64_t height = std::int64_t{layout.window.max.y} - layout.window.min.y + 1;
  if (width < 1 || height < 1 || width > kMaxSide || height > kMaxSide) {
    return wrong(fmt::format("is {}x{} texels, expected 1 to {} a side", width, height, kMaxSide));
  }
  if (channels->num_channels < 1 || channels->num_channels > static_cast<int>(kMaxDatasetChannels)) {
    return wrong(
        fmt::format("has {} channels, expected 1 to {}", channels->num_channels, kMaxDatasetChannels));
  }
  layout.type = channels->entries[0].pixel_type;
  for (int i = 0; i < channels->num_channels; ++i) {
    const exr_attr_chlist_entry_t& each = channels->entries[i];
    layout.names.emplace_back(each.name.str, static_cast<std::size_t>(each.name.length));
    if (each.x_sampling != 1 || each.y_sampling != 1 || each.pixel_type != layout.type ||
        (layout.type != EXR_PIXEL_HALF && layout.type != EXR_PIXEL_FLOAT)) {
      return wrong(fmt::format("has a channel '{}', expected half or float samples for all, at every texel",
                               layout.names.back()));
    }
  }
  return layout;
}

// The data set's channels: as the first part lists them; else R, G, B; else as in the file.
Result<std::vector<std::string>> channels_of(const OpenExr& file, const Layout& layout) {
  std::vector<std::string> usual = layout.names;
  if (usual == std::vector<std::string>{"B", "G", "R"}) std::reverse(usual.begin(), usual.end());
  const std::vector<std::string> listed = Attributes(file, 0).texts(kBtfExrChannels).value_or(usual);
  if (listed.size() == layout.names.size() &&
      std::is_permutation(listed.begin(), listed.end(), layout.names.begin())) {
    return listed;
  }
  return refused(file.path(), fmt::format("{} does not list the channels of the file", kBtfExrChannels));
}

// The conventions that the first part states.
Result<DatasetInfo> info_of(const OpenExr& file, const Layout& layout) {
  const Attributes first(file, 0);
  DatasetInfo info;
  const auto wrong = [&](const char* name, const std::string& value, const char* expected) {
    return refused(file.path(), fmt::format("{} is '{}', expected {}", name, value, expected));
  };
  const std::optional<std::int32_t> version = first.integer(kBtfExrVersionName);
  if (!version || *version < 1) return refused(file.path(), "no BTF: the first part has no btfc:version");
  if (*version > kBtfExrVersion) {
    return refused(file.path(),
                   fmt::format("{} is {}, expected {}", kBtfExrVersionName, *version, kBtfExrVersion),
                   Status::unsupported);
  }
  const std::string type = first.text(kBtfExrSampleType).value_or(name_of(SampleType::float16));
  info.type = SampleType::float16;
  if (type == name_of(SampleType::unorm8)) info.type = SampleType::unorm8;
  if (type == name_of(SampleType::unorm16)) info.type = SampleType::unorm16;
  if (type != name_of(info.type)) return wrong(kBtfExrSampleType, type, "unorm8, unorm16 or float16");
  if (info.type == SampleType::unorm16 && layout.type != EXR_PIXEL_FLOAT) {
    return wrong(kBtfExrSampleType, type, "float channels for it");
  }
  const std::string quantity = first.text(kBtfExrQuantity).value_or(name_of(Quantity::unspecified));
  const std::optional<Quantity> found = quantity_of(quantity);
  if (!found) {
    return wrong(kBtfExrQuantity, quantity, "unspecified, reflectance, reflectance_cos, radiance or data");
  }
  info.quantity = *found;
  const std::string space = first.text(kBtfExrColourSpace).value_or(name_of(ColourSpace::unknown));
  const std::optional<ColourSpace> known = colour_space_of(space);
  if (!known) return wrong(kBtfExrColourSpace, space, "a colour space of the format");
  info.colour_space = *known;
  const std::int32_t wraps = first.integer(kBtfExrWraps).value_or(0);
  if (wraps != 0 && wraps != 1) return wrong(kBtfExrWraps, std::to_string(wraps), "0 or 1");
  info.wraps = wraps == 1;
  info.width = layout.width();
  info.height = layout.height();
  Result<std::vector<std::string>> channels = channels_of(file, layout);
  if (!channels) return channels.error();
  info.channels = std::move(*channels);
  return info;
}

// Directions of one kind: numbers that the file gives, or one for each pair of angles in the order of parts.
class DirectionList {
 public:
  DirectionList(const char* name, std::vector<Direction>& list) : name_(name), list_(list) {}

  // Number of the part's direction; the sentence about a fault in `fault`.
  std::uint32_t add(const Attributes& part, std::optional<std::int32_t> number, std::string& fault) {
    const exr_attr_v2d_t* angles = part.pair_of_doubles(name_);
    if (angles == nullptr) return fault = fmt::format("has no {} (two doubles)", name_), 0u;
    // A direction on the horizon may lie a rounding error below it.
    if (!std::isfinite(angles->y) || !(angles->x >= 0 && angles->x <= 90 + 1e-6)) {
      return fault = fmt::format("has {} ({}, {}), expected theta 0 to 90 and phi in degrees", name_,
                                 angles->x, angles->y),
             0u;
    }
    const std::pair<double, double> key = {angles->x, angles->y};
    if (!number) {
      return find(by_angles_, key, *angles);
    }
    if (*number < 0) return fault = fmt::format("has the number {} in {}", *number, kBtfExrPair), 0u;
    const auto known = angles_.find(*number);
    if (known == angles_.end()) {
      angles_[*number] = key;
    } else if (known->second != key) {
      return fault = fmt::format("has {} ({}, {}), and another part has ({}, {}) with the same number", name_,
                                 key.first, key.second, known->second.first, known->second.second),
             0u;
    }
    return find(by_number_, *number, *angles);
  }

  // Where there are numbers, their order is the directions'; returns the new place of each.
  std::vector<std::uint32_t> sort() {
    std::vector<std::uint32_t> place(list_.size());
    std::iota(place.begin(), place.end(), 0u);
    if (by_number_.empty()) return place;
    std::vector<Direction> sorted;
    for (const auto& [number, index] : by_number_) {
      place[index] = static_cast<std::uint32_t>(sorted.size());
      sorted.push_back(list_[index]);
    }
    list_ = std::move(sorted);
    return place;
  }

 private:
  template <class Key>
  std::uint32_t find(std::map<Key, std::uint32_t>& numbers, const Key& key, const exr_attr_v2d_t& angles) {
    const auto [found, fresh] = numbers.emplace(key, static_cast<std::uint32_t>(list_.size()));
    if (fresh) list_.push_back(direction_from_degrees(angles.x, angles.y));
    return found->second;
  }

  const char* name_;
  std::vector<Direction>& list_;
  std::map<std::pair<double, double>, std::uint32_t> by_angles_;
  std::map<std::int32_t, std::uint32_t> by_number_;
  std::map<std::int32_t, std::pair<double, double>> angles_;
};

// Fills views, lights and pairs; returns the part of each pair.
Result<std::vector<int>> read_pairs(const OpenExr& file, int parts, const Layout& layout, DatasetInfo& info) {
  DirectionList views(kBtfExrView, info.views), lights(kBtfExrLight, info.lights);
  const bool numbered = Attributes(file, 0).pair_of_integers(kBtfExrPair) != nullptr;
  std::vector<DirectionPair> pairs;
  for (int part = 0; part < parts; ++part) {
    const Result<Layout> own = layout_of(file, part);
    if (!own) return own.error();
    if (!(*own == layout)) {
      return refused(file.path(),
                     fmt::format("part {} has other channels or another data window than part 0", part));
    }
    const Attributes attributes(file, part);
    const exr_attr_v2i_t* pair = attributes.pair_of_integers(kBtfExrPair);
    std::string fault;
    if ((pair != nullptr) != numbered) fault = fmt::format("differs from part 0 in having {}", kBtfExrPair);
    DirectionPair numbers;
    const auto number = [&](int i) { return pair == nullptr ? std::nullopt : std::optional(pair->arr[i]); };
    if (fault.empty()) numbers.view = views.add(attributes, number(0), fault);
    if (fault.empty()) numbers.light = lights.add(attributes, number(1), fault);
    if (!fault.empty()) return refused(file.path(), fmt::format("part {} {}", part, fault));
    pairs.push_back(numbers);
  }
  const std::vector<std::uint32_t> view_places = views.sort(), light_places = lights.sort();
  for (DirectionPair& pair : pairs) pair = {view_places[pair.view], light_places[pair.light]};
  std::vector<int> order(pairs.size());
  std::iota(order.begin(), order.end(), 0);
  const auto of = [&](int part) { return pairs[static_cast<std::size_t>(part)]; };
  std::sort(order.begin(), order.end(), [&](int a, int b) {
    return std::tuple(of(a).view, of(a).light, a) < std::tuple(of(b).view, of(b).light, b);
  });
  for (std::size_t i = 0; i < order.size(); ++i) {
    info.pairs.push_back(of(order[i]));
    if (i > 0 && info.pairs[i - 1] == info.pairs[i]) {
      return refused(file.path(), fmt::format("parts {} and {} have the same view {} and light {}",
                                              order[i - 1], order[i], to_text(info.views[info.pairs[i].view]),
                                              to_text(info.lights[info.pairs[i].light])));
    }
  }
  return order;
}

// A sample's code, or none where it has no such.
std::optional<std::uint16_t> code_of(SampleType type, float value) {
  if (type == SampleType::float16) return finite_half(value);
  // Half rounds the highest 8-bit codes by up to 0.06 of one.
  const double scaled = static_cast<double>(value) * (type == SampleType::unorm8 ? 255 : 65535);
  const double code = std::nearbyint(scaled);
  if (!(code >= 0 && code <= (type == SampleType::unorm8 ? 255 : 65535) &&
        std::fabs(scaled - code) <= 0.25)) {
    return std::nullopt;
  }
  return static_cast<std::uint16_t>(code);
}

class PartReader {
 public:
  PartReader(const OpenExr& file, const Layout& layout, const DatasetInfo& info, const Rectangle& crop)
      : file_(file), layout_(layout), crop_(crop), type_(info.type) {
    for (const std::string& name : layout.names) {
      const auto found = std::find(info.channels.begin(), info.channels.end(), name);
      places_.push_back(static_cast<std::size_t>(found - info.channels.begin()));
    }
  }

  Result<std::vector<std::uint16_t>> read(int part) const {
    std::vector<std::uint16_t> codes(std::size_t{crop_.width} * crop_.height * places_.size());
    exr_decode_pipeline_t pipeline = {};
    last_message.clear();
    Result<Done> done = read_chunks(part, pipeline, codes);
    exr_decoding_destroy(file_.context(), &pipeline);
    if (!done) return done.error();
    return codes;
  }

 private:
  Result<Done> read_chunks(int part, exr_decode_pipeline_t& pipeline,
                           std::vector<std::uint16_t>& codes) const {
    int lines = 0;
    const exr_result_t result = exr_get_scanlines_per_chunk(file_.context(), part, &lines);
    if (result != EXR_ERR_SUCCESS || lines < 1) return file_.failed(result);
    Bytes samples;
    const auto step = static_cast<std::uint32_t>(lines);
    bool first = true;
    for (std::uint32_t y = crop_.y / step * step; y < crop_.y + crop_.height; y += step, first = false) {
      const std::uint32_t count = std::min(step, layout_.height() - y);
      samples.resize(std::size_t{count} * line_bytes());
      const exr_result_t read = read_chunk(part, y, count, first, pipeline, samples);
      if (read != EXR_ERR_SUCCESS) return file_.failed(read);
      if (const auto kept = keep(part, y, count, samples, codes); !kept) return kept.error();
    }
    return Done{};
  }

  std::size_t line_bytes() const {
    return std::size_t{layout_.width()} * places_.size() * layout_.sample_bytes();
  }

  exr_result_t read_chunk(int part, std::uint32_t y, std::uint32_t count, bool first,
                          exr_decode_pipeline_t& pipeline, Bytes& samples) const {
    const exr_const_context_t context = file_.context();
    exr_chunk_info_t chunk;
    exr_result_t result =
        exr_read_scanline_chunk_info(context, part, layout_.window.min.y + static_cast<int>(y), &chunk);
    if (result != EXR_ERR_SUCCESS) return result;
    // OpenEXR 3.1 does not notice that a chunk without compression is too short.
    const bool short_chunk = chunk.compression == EXR_COMPRESSION_NONE && chunk.packed_size < samples.size();
    if (chunk.height != static_cast<int>(count) || chunk.width != static_cast<int>(layout_.width()) ||
        chunk.unpacked_size != samples.size() || chunk.packed_size > file_.size() || short_chunk) {
      return EXR_ERR_CORRUPT_CHUNK;
    }
    result = first ? exr_decoding_initialize(context, part, &chunk, &pipeline)
                   : exr_decoding_update(context, part, &chunk, &pipeline);
    if (result != EXR_ERR_SUCCESS) return result;
    const std::size_t bytes = layout_.sample_bytes();
    for (int i = 0; i < pipeline.channel_count; ++i) {
      exr_coding_channel_info_t& channel = pipeline.channels[i];
      channel.user_data_type = channel.data_type;
      channel.user_bytes_per_element = static_cast<std::int16_t>(bytes);
      channel.user_pixel_stride = static_cast<std::int32_t>(places_.size() * bytes);
      channel.user_line_stride = static_cast<std::int32_t>(line_bytes());
      channel.decode_to_ptr = samples.data() + places_[static_cast<std::size_t>(i)] * bytes;
    }
    if (first) result = exr_decoding_choose_default_routines(context, part, &pipeline);
    if (result != EXR_ERR_SUCCESS) return result;
    return exr_decoding_run(context, part, &pipeline);
  }

  // The chunk's texels inside the crop as codes.
  Result<Done> keep(int part, std::uint32_t y, std::uint32_t count, const Bytes& samples,
                    std::vector<std::uint16_t>& codes) const {
    const std::uint32_t begin = std::max(y, crop_.y), end = std::min(y + count, crop_.y + crop_.height);
    const std::size_t row_samples = std::size_t{crop_.width} * places_.size();
    for (std::uint32_t row = begin; row < end; ++row) {
      const std::uint8_t* from = samples.data() + (row - y) * line_bytes() +
                                 std::size_t{crop_.x} * places_.size() * layout_.sample_bytes();
      std::uint16_t* to = codes.data() + (row - crop_.y) * row_samples;
      for (std::size_t i = 0; i < row_samples; ++i, from += layout_.sample_bytes()) {
        float value = 0;
        std::uint16_t half = 0;
        if (layout_.type == EXR_PIXEL_HALF) {
          std::memcpy(&half, from, 2);
          // What most files have: the codes themselves.
          if (type_ == SampleType::float16 && (half & 0x7c00u) != 0x7c00u) {
            to[i] = half;
            continue;
          }
          value = btfc_half_to_float(half);
        } else {
          std::memcpy(&value, from, 4);
        }
        const std::optional<std::uint16_t> code = code_of(type_, value);
        if (!code) {
          return refused(file_.path(),
                         fmt::format("part {} has {} at ({}, {}), expected {}", part, value,
                                     crop_.x + i / places_.size(), row,
                                     type_ == SampleType::float16 ? "finite values up to 65504"
                                                                  : "the values of integer codes"));
        }
        to[i] = *code;
      }
    }
    return Done{};
  }

  const OpenExr& file_;
  const Layout& layout_;
  Rectangle crop_;
  SampleType type_;
  std::vector<std::size_t> places_;  // in the data set, of the file's channels
};

Result<DatasetRead> read(const std::string& path, const DatasetReadOptions& options) {
  const Result<OpenExr> file = OpenExr::open(path);
  if (!file) return file.error();
  int parts = 0;
  if (const exr_result_t result = exr_get_count(file->context(), &parts); result != EXR_ERR_SUCCESS) {
    return file->failed(result);
  }
  if (parts < 1 || parts > static_cast<int>(kMaxPairs)) {
    return refused(path, fmt::format("{} parts, expected 1 to {}", parts, kMaxPairs));
  }
  const Result<Layout> layout = layout_of(*file, 0);
  if (!layout) return layout.error();
  Result<DatasetInfo> info = info_of(*file, *layout);
  if (!info) return info.error();
  const Result<std::vector<int>> order = read_pairs(*file, parts, *layout, *info);
  if (!order) return order.error();
  const Result<PairChoice> choice = pairs_to_read(options, *info);
  if (!choice) return choice.error();
  const CheckedSize bytes = CheckedSize(info->image_samples()) * layout->sample_bytes() * order->size();
  if (bytes.saturated() > (CheckedSize(file->size()) * kMaxRatio).saturated()) {
    return refused(path, fmt::format("{} bytes cannot hold {} images of {}x{} texels", file->size(),
                                     order->size(), info->width, info->height));
  }
  const Result<Rectangle> crop = kept_texels(options, info->width, info->height, path);
  if (!crop) return crop.error();
  info->width = crop->width;
  info->height = crop->height;
  info = chosen_info(*info, *choice);
  const Result<ImageReduction> reduction = reduction_to_read(options, *info, path);
  if (!reduction) return reduction.error();
  Result<Dataset> dataset = Dataset::create(reduced_info(*info, *reduction), options.scratch_directory);
  if (!dataset) return dataset.error();
  const PartReader reader(*file, *layout, *info, *crop);
  const Result<Done> done = for_each_index(
      choice->pairs.size(),
      [&](std::size_t i) -> Result<Done> {
        Result<std::vector<std::uint16_t>> codes = reader.read((*order)[choice->pairs[i]]);
        if (!codes) return codes.error();
        dataset->write_image(i, reduced_codes(*info, *std::move(codes), *reduction));
        return Done{};
      },
      options.progress);
  if (!done) return done.error();
  return DatasetRead{std::move(*dataset), choice->pairs.size(), "btf_exr", {}};
}

}  // namespace

bool is_btf_exr(const std::string& path) {
  struct stat found {};
  if (stat(path.c_str(), &found) != 0 || !S_ISREG(found.st_mode)) return false;
  const int file = open(path.c_str(), O_RDONLY | O_CLOEXEC);
  if (file < 0) return false;
  Bytes bytes(kLookBytes);
  const ssize_t got = ::read(file, bytes.data(), bytes.size());
  close(file);
  bytes.resize(static_cast<std::size_t>(std::max<ssize_t>(got, 0)));
  if (bytes.size() < 8 || load_u32(bytes.data()) != 0x01312f76u) return false;
  // Attributes of the first header: name, type, size, value; an empty name ends it.
  for (std::size_t at = 8; at < bytes.size();) {
    const auto begin = bytes.begin() + static_cast<std::ptrdiff_t>(at);
    const auto name_end = std::find(begin, bytes.end(), 0);
    if (name_end == bytes.end() || name_end == begin) return false;
    if (std::string(begin, name_end) == kBtfExrVersionName) return true;
    const auto type_end = std::find(name_end + 1, bytes.end(), 0);
    if (bytes.end() - type_end < 5) return false;
    at = static_cast<std::size_t>(type_end - bytes.begin()) + 5;
    const std::uint64_t next = at + load_u32(&bytes[at - 4]);
    at = static_cast<std::size_t>(std::min<std::uint64_t>(next, bytes.size()));
  }
  return false;
}

Result<DatasetRead> read_btf_exr(const std::string& path, const DatasetReadOptions& options) {
  try {
    return read(path, options);
  } catch (const std::bad_alloc&) {
    return Error{Status::out_of_memory, fmt::format("no memory to read '{}'", path), "", 0};
  }
}

}  // namespace btfc
