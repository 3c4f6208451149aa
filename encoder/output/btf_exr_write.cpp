// By OpenEXR's C interface: its C++ classes keep the buffers of every part that was written, which for
// thousands of parts is gigabytes.
#include "encoder/output/btf_exr_write.h"

#include <fmt/format.h>
#include <openexr.h>
#include <tbb/parallel_pipeline.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cstring>
#include <new>
#include <optional>
#include <set>
#include <vector>

#include "encoder/colour_primaries.h"
#include "encoder/input/btf_exr_names.h"
#include "encoder/output/atomic_file.h"
#include "shaders/btfc_half.h"

namespace btfc {
namespace {

// What OpenEXR's C++ classes take: files as small as by zlib's own choice, in half the time.
constexpr int kZipLevel = 4;

// What OpenEXR said last on this thread: its error codes alone say little.
thread_local std::string last_message;
void keep_message(exr_const_context_t, exr_result_t, const char* message) { last_message = message; }

// The pending file behind a buffer, since headers are written in pieces of a few bytes.
class Stream {
 public:
  explicit Stream(PendingFile& file) : file_(file) {}
  bool write(const std::uint8_t* data, std::size_t size, std::uint64_t offset) {
    if (offset != begin_ + buffer_.size() || buffer_.size() > kBufferBytes) {
      if (!flush()) return false;
      begin_ = offset;
    }
    buffer_.insert(buffer_.end(), data, data + size);
    return true;
  }
  bool flush() {
    const bool good = file_.write_at(begin_, buffer_);
    begin_ += buffer_.size();
    buffer_.clear();
    return good;
  }

 private:
  static constexpr std::size_t kBufferBytes = 1u << 20;
  PendingFile& file_;
  Bytes buffer_;
  std::uint64_t begin_ = 0;
};

std::int64_t write_bytes(exr_const_context_t context, void* stream, const void* data, std::uint64_t size,
                         std::uint64_t offset, exr_stream_error_func_ptr_t failed) {
  if (!static_cast<Stream*>(stream)->write(static_cast<const std::uint8_t*>(data), size, offset)) {
    return failed(context, EXR_ERR_WRITE_IO, "the file could not be written"), -1;
  }
  return static_cast<std::int64_t>(size);
}

// Remembers the first call that failed and makes no more after it.
class Writer {
 public:
  Writer(Stream& stream, const std::string& path) : path_(path) {
    exr_context_initializer_t init = EXR_DEFAULT_CONTEXT_INITIALIZER;
    init.error_handler_fn = keep_message;
    init.user_data = &stream;
    init.write_fn = write_bytes;
    init.zip_level = kZipLevel;
    check(exr_start_write(&context_, path.c_str(), EXR_WRITE_FILE_DIRECTLY, &init));
  }
  Writer(const Writer&) = delete;
  Writer& operator=(const Writer&) = delete;
  ~Writer() { finish(); }

  template <class Call, class... Arguments>
  void operator()(Call call, Arguments... arguments) {
    if (good()) check(call(context_, arguments...));
  }
  // Writes the tables of offsets.
  void finish() {
    if (context_ != nullptr) check(exr_finish(&context_));
    context_ = nullptr;
  }
  void fail(std::string message) {
    if (good()) message_ = std::move(message);
  }
  bool good() const { return message_.empty(); }
  Error error() const { return io_error(fmt::format("could not write '{}': {}", path_, message_)); }
  exr_context_t context() const { return context_; }

 private:
  void check(exr_result_t result) {
    if (result != EXR_ERR_SUCCESS)
      fail(last_message.empty() ? exr_get_error_code_as_string(result) : last_message);
  }
  exr_context_t context_ = nullptr;
  std::string path_, message_;
};

std::optional<exr_attr_chromaticities_t> chromaticities_of(ColourSpace space) {
  for (const auto& [known, xy] : kPrimaries) {
    if (known == space) {
      return exr_attr_chromaticities_t{xy[0], xy[1], xy[2], xy[3], xy[4], xy[5], xy[6], xy[7]};
    }
  }
  return std::nullopt;
}

std::string part_name(const DatasetInfo& info, const DirectionPair& pair) {
  const auto angles = [](const Direction& d) {
    return fmt::format("{:07.3f}_{:07.3f}", degrees(d.theta), degrees(d.phi));
  };
  return fmt::format("v{} l{}", angles(info.views[pair.view]), angles(info.lights[pair.light]));
}

exr_attr_v2d_t in_degrees(const Direction& direction) {
  exr_attr_v2d_t angles;
  angles.x = degrees(direction.theta);
  angles.y = degrees(direction.phi);
  return angles;
}

void add_parts(Writer& write, const DatasetInfo& info) {
  std::set<std::string> names;
  const exr_pixel_type_t type = info.type == SampleType::unorm16 ? EXR_PIXEL_FLOAT : EXR_PIXEL_HALF;
  const std::optional<exr_attr_chromaticities_t> chromaticities = chromaticities_of(info.colour_space);
  for (std::size_t i = 0; i < info.pairs.size() && write.good(); ++i) {
    const DirectionPair& pair = info.pairs[i];
    std::string name = part_name(info, pair);
    if (!names.insert(name).second) {  // directions nearer than the digits tell
      name += fmt::format(" {}", i);
      names.insert(name);
    }
    int part = 0;
    write(exr_add_part, name.c_str(), EXR_STORAGE_SCANLINE, &part);
    write(exr_initialize_required_attr_simple, part, static_cast<int>(info.width),
          static_cast<int>(info.height), EXR_COMPRESSION_ZIP);
    for (const std::string& channel : info.channels) {
      write(exr_add_channel, part, channel.c_str(), type, EXR_PERCEPTUALLY_LOGARITHMIC, 1, 1);
    }
    const exr_attr_v2d_t view = in_degrees(info.views[pair.view]);
    const exr_attr_v2d_t light = in_degrees(info.lights[pair.light]);
    exr_attr_v2i_t numbers;
    numbers.x = static_cast<std::int32_t>(pair.view);
    numbers.y = static_cast<std::int32_t>(pair.light);
    write(exr_attr_set_v2d, part, kBtfExrView, &view);
    write(exr_attr_set_v2d, part, kBtfExrLight, &light);
    write(exr_attr_set_v2i, part, kBtfExrPair, &numbers);
    if (chromaticities) {
      write(exr_attr_set_chromaticities, part, "chromaticities", &*chromaticities);
    }
  }
  std::vector<const char*> channels;
  for (const std::string& channel : info.channels) channels.push_back(channel.c_str());
  write(exr_attr_set_int, 0, kBtfExrVersionName, kBtfExrVersion);
  write(exr_attr_set_string, 0, kBtfExrSampleType, name_of(info.type));
  write(exr_attr_set_string, 0, kBtfExrQuantity, name_of(info.quantity));
  write(exr_attr_set_string, 0, kBtfExrColourSpace, name_of(info.colour_space));
  write(exr_attr_set_int, 0, kBtfExrWraps, info.wraps ? 1 : 0);
  write(exr_attr_set_string_vector, 0, kBtfExrChannels, static_cast<int>(channels.size()), channels.data());
}

// An image's chunks, ready to be written.
struct Packed {
  std::size_t pair = 0;
  Bytes bytes;
  std::vector<std::size_t> sizes;  // of the chunks
  int chunk_lines = 1;             // of all but the last
  std::string fault;
};

std::array<std::uint16_t, 256> halves_of_bytes() {
  std::array<std::uint16_t, 256> halves{};
  for (std::uint16_t c = 0; c < 256; ++c) {
    halves[c] = static_cast<std::uint16_t>(btfc_float_to_half(code_value(SampleType::unorm8, c)));
  }
  return halves;
}

// Samples as the file has them: halves or floats, channels interleaved.
Bytes samples_of(const Dataset& dataset, std::size_t pair) {
  const SampleType type = dataset.info().type;
  std::vector<std::uint16_t> codes(dataset.info().image_samples());
  dataset.read_image(pair, codes);
  Bytes bytes(codes.size() * (type == SampleType::unorm16 ? 4 : 2));
  static const std::array<std::uint16_t, 256> halves = halves_of_bytes();
  if (type == SampleType::unorm16) {
    for (std::size_t i = 0; i < codes.size(); ++i) {
      const float value = code_value(type, codes[i]);
      std::memcpy(&bytes[4 * i], &value, 4);
    }
  } else {
    if (type == SampleType::unorm8) {
      for (std::uint16_t& code : codes) code = halves[code];
    }
    std::memcpy(bytes.data(), codes.data(), bytes.size());
  }
  return bytes;
}

class ImagePacker {
 public:
  ImagePacker(const Dataset& dataset, exr_context_t context) : dataset_(dataset), context_(context) {}

  Packed pack(std::size_t pair) const {
    Packed packed;
    packed.pair = pair;
    const Bytes samples = samples_of(dataset_, pair);
    exr_encode_pipeline_t pipeline = {};
    exr_result_t result = EXR_ERR_SUCCESS;
    const auto height = static_cast<int>(dataset_.info().height);
    for (int y = 0; y < height && result == EXR_ERR_SUCCESS; y += packed.chunk_lines) {
      result = pack_chunk(static_cast<int>(pair), y, samples, pipeline, packed);
    }
    exr_encoding_destroy(context_, &pipeline);
    if (result != EXR_ERR_SUCCESS) packed.fault = exr_get_error_code_as_string(result);
    return packed;
  }

 private:
  exr_result_t pack_chunk(int part, int y, const Bytes& samples, exr_encode_pipeline_t& pipeline,
                          Packed& packed) const {
    exr_chunk_info_t chunk;
    exr_result_t result = exr_write_scanline_chunk_info(context_, part, y, &chunk);
    if (result != EXR_ERR_SUCCESS) return result;
    const bool first = y == 0;
    if (first) packed.chunk_lines = chunk.height;
    result = first ? exr_encoding_initialize(context_, part, &chunk, &pipeline)
                   : exr_encoding_update(context_, part, &chunk, &pipeline);
    if (result != EXR_ERR_SUCCESS) return result;
    set_channels(y, samples, pipeline);
    if (first) {
      result = exr_encoding_choose_default_routines(context_, part, &pipeline);
      if (result != EXR_ERR_SUCCESS) return result;
      // The chunk is only compressed here: it is written in its turn.
      pipeline.yield_until_ready_fn = nullptr;
      pipeline.write_fn = nullptr;
    }
    result = exr_encoding_run(context_, part, &pipeline);
    if (result != EXR_ERR_SUCCESS) return result;
    // A chunk as large as its samples is read as not compressed; OpenEXR 3.1 takes one for compressed that
    // has that size by chance.
    const bool raw = pipeline.compressed_bytes >= pipeline.packed_bytes;
    const std::size_t size = raw ? pipeline.packed_bytes : pipeline.compressed_bytes;
    const auto* bytes =
        static_cast<const std::uint8_t*>(raw ? pipeline.packed_buffer : pipeline.compressed_buffer);
    packed.bytes.insert(packed.bytes.end(), bytes, bytes + size);
    packed.sizes.push_back(size);
    return EXR_ERR_SUCCESS;
  }

  // OpenEXR has the channels in the order of their names.
  void set_channels(int y, const Bytes& samples, exr_encode_pipeline_t& pipeline) const {
    const DatasetInfo& info = dataset_.info();
    const std::size_t sample_bytes = samples.size() / info.image_samples();
    const std::size_t line = info.width * info.channels.size() * sample_bytes;
    for (int i = 0; i < pipeline.channel_count; ++i) {
      exr_coding_channel_info_t& channel = pipeline.channels[i];
      const auto place = std::find(info.channels.begin(), info.channels.end(), channel.channel_name);
      const auto number = static_cast<std::size_t>(place - info.channels.begin());
      channel.user_data_type = channel.data_type;
      channel.user_bytes_per_element = static_cast<std::int16_t>(sample_bytes);
      channel.user_pixel_stride = static_cast<std::int32_t>(info.channels.size() * sample_bytes);
      channel.user_line_stride = static_cast<std::int32_t>(line);
      channel.encode_from_ptr = samples.data() + static_cast<std::size_t>(y) * line + number * sample_bytes;
    }
  }

  const Dataset& dataset_;
  exr_context_t context_;
};

void write_image_chunks(Writer& write, const Packed& packed) {
  if (!packed.fault.empty()) write.fail(packed.fault);
  const std::uint8_t* from = packed.bytes.data();
  int y = 0;
  for (const std::size_t size : packed.sizes) {
    write(exr_write_scanline_chunk, static_cast<int>(packed.pair), y, static_cast<const void*>(from),
          std::uint64_t{size});
    from += size;
    y += packed.chunk_lines;
  }
}

Result<Done> check_names(const DatasetInfo& info) {
  const std::set<std::string> names(info.channels.begin(), info.channels.end());
  const bool good = std::all_of(names.begin(), names.end(), [](const std::string& name) {
    return !name.empty() && name.size() < 256 && name.find('\0') == std::string::npos;
  });
  if (names.size() == info.channels.size() && good) return Done{};
  return bad_argument(
      fmt::format("a data set of {} channels with {} names, expected different ones of 1 to 255 bytes to "
                  "write an EXR file",
                  info.channels.size(), names.size()));
}

Result<Done> write(const Dataset& dataset, const std::string& path,
                   const std::function<void(std::size_t, std::size_t)>& progress) {
  const DatasetInfo& info = dataset.info();
  if (const auto good = check_names(info); !good) return good.error();
  Result<PendingFile> pending = PendingFile::create(path);
  if (!pending) return pending.error();
  Stream stream(*pending);
  Writer writer(stream, path);
  const bool long_names = std::any_of(info.channels.begin(), info.channels.end(),
                                      [](const std::string& name) { return name.size() > 31; });
  writer(exr_set_longname_support, long_names ? 1 : 0);
  add_parts(writer, info);
  writer(exr_write_header);

  const ImagePacker packer(dataset, writer.context());
  std::size_t next = 0;
  std::atomic<bool> stop{!writer.good()};
  const auto tokens = 2 * static_cast<std::size_t>(tbb::this_task_arena::max_concurrency());
  tbb::parallel_pipeline(
      tokens,
      tbb::make_filter<void, std::size_t>(tbb::filter_mode::serial_in_order, [&](tbb::flow_control& control) {
        if (next == info.pairs.size() || stop) control.stop();
        return next++;
      }) & tbb::make_filter<std::size_t, Packed>(tbb::filter_mode::parallel, [&](std::size_t pair) {
        return packer.pack(pair);
      }) & tbb::make_filter<Packed, void>(tbb::filter_mode::serial_in_order, [&](const Packed& packed) {
        write_image_chunks(writer, packed);
        stop = !writer.good();
        if (progress) progress(packed.pair + 1, info.pairs.size());
      }));
  writer.finish();
  if (!stream.flush()) return pending->commit();  // says what the disk said
  if (!writer.good()) return writer.error();
  return pending->commit();
}

}  // namespace

Result<Done> write_btf_exr(const Dataset& dataset, const std::string& path,
                           const std::function<void(std::size_t, std::size_t)>& progress) {
  try {
    return write(dataset, path, progress);
  } catch (const std::bad_alloc&) {
    return Error{Status::out_of_memory, fmt::format("no memory to write '{}'", path), "", 0};
  }
}

}  // namespace btfc
