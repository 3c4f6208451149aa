// Apparent BRDFs to images.
#include "encoder/input/ubo2014_bdi.h"

#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <mutex>

#include "encoder/dataset/scratch.h"
#include "encoder/for_each_index.h"
#include "encoder/input/ubo2014_expand.h"

namespace btfc {
namespace {

enum Compression : unsigned { kFull = 0, kBzip = 1, kSparse = 2 };

void read_chunks(Ubo2014Cursor& cursor, Ubo2014Bdi& body) {
  for (std::uint64_t first = 0; first < body.stored && !cursor.failed(); first += body.chunk_texels) {
    const std::string what = fmt::format("chunk {}", body.chunks.size());
    const std::uint64_t size = cursor.u32(what);
    const CheckedSize full = CheckedSize(body.chunk_texels) * body.abrdf_bytes;
    const CheckedSize expected =
        CheckedSize(std::min(body.chunk_texels, body.stored - first)) * body.abrdf_bytes;
    // The authors' writer fills the last chunk up where it copies another BDI file.
    if (!cursor.failed() && size != expected.saturated() && size != full.saturated()) {
      cursor.refuse(fmt::format("{} has {} bytes, expected {}", what, size, expected.saturated()));
    }
    body.chunks.push_back(cursor.skip(size, what));
  }
}

class Gatherer {
 public:
  Gatherer(const Ubo2014File& file, const Ubo2014Header& header, const Ubo2014Bdi& body,
           const Rectangle& crop)
      : bytes_(file.bytes()), header_(header), body_(body), crop_(crop) {}

  std::size_t channels() const { return header_.channels.size(); }
  std::size_t image_samples() const { return std::size_t{crop_.width} * crop_.height * channels(); }

  // Row y of the crop for pairs first … first+count-1: images[i * image_samples() …]. The sentence about the
  // first half that is not finite, or nothing.
  std::string row(std::uint32_t y, std::size_t first, std::size_t count, std::uint16_t* images) const {
    const std::uint64_t begin = std::uint64_t{crop_.y + y} * header_.width;
    std::uint64_t number = body_.row_begins[crop_.y + y];
    for (std::uint64_t x = 0; x < std::uint64_t{crop_.x} + crop_.width; ++x) {
      if (body_.sparse && bytes_[body_.mask + begin + x] == 0) continue;
      const std::uint64_t own = number++;
      if (x < crop_.x) continue;
      const std::uint8_t* from = bytes_.data() + body_.chunks[own / body_.chunk_texels] +
                                 own % body_.chunk_texels * body_.abrdf_bytes + 2 * first * channels();
      std::uint16_t* to = images + (std::size_t{y} * crop_.width + (x - crop_.x)) * channels();
      for (std::size_t i = 0; i < count; ++i, to += image_samples()) {
        for (std::size_t c = 0; c < channels(); ++c, from += 2) {
          to[c] = load_u16(from);
          if ((to[c] & 0x7c00u) != 0x7c00u) continue;
          return fmt::format("{} is not finite", ubo2014_place(header_, first + i, begin + x, c));
        }
      }
    }
    return {};
  }

 private:
  ByteView bytes_;
  const Ubo2014Header& header_;
  const Ubo2014Bdi& body_;
  Rectangle crop_;
};

}  // namespace

Ubo2014Bdi read_ubo2014_bdi(Ubo2014Cursor& cursor, Ubo2014Header& header) {
  Ubo2014Bdi body;
  const std::uint32_t scan_lines = cursor.u32("the scan lines of a chunk");
  const unsigned compression = cursor.u8("the compression");
  if (compression == kBzip)
    cursor.refuse_unsupported("a BDI file compressed by bzip, which is not supported");
  if (!cursor.failed() && (scan_lines < 1 || compression > kSparse)) {
    cursor.refuse(
        fmt::format("chunks of {} scan lines with compression {}, expected at least 1 and 0, 1 or 2",
                    scan_lines, compression));
  }
  body.sparse = compression == kSparse;
  body.mask = cursor.skip(header.texels(), "the mask");
  read_ubo2014_rotations(cursor, header);
  if (cursor.failed()) return body;
  for (std::uint32_t y = 0; y < header.height; ++y) {
    body.row_begins.push_back(body.stored);
    const std::uint8_t* row = cursor.data(body.mask + std::uint64_t{y} * header.width);
    const auto missing = static_cast<std::uint64_t>(std::count(row, row + header.width, 0));
    body.stored += header.width - (body.sparse ? missing : 0);
  }
  if (body.stored == 0) cursor.refuse("the mask leaves no texel");
  if (body.stored < header.texels()) {
    header.notes.push_back(fmt::format("{} of {} texels are not stored and read as 0",
                                       header.texels() - body.stored, header.texels()));
  }
  body.chunk_texels = std::uint64_t{header.width} * scan_lines;
  body.abrdf_bytes = std::uint64_t{header.pairs()} * header.channels.size() * 2;
  read_chunks(cursor, body);
  return body;
}

Result<Done> gather_ubo2014_bdi(const Ubo2014File& file, const Ubo2014Header& header, const Ubo2014Bdi& body,
                                const Rectangle& crop, const DatasetReadOptions& options, Dataset& dataset,
                                std::uint64_t gather_bytes) {
  const Gatherer gatherer(file, header, body, crop);
  const std::size_t pairs = header.pairs(), samples = gatherer.image_samples();
  const std::size_t group = std::clamp<std::size_t>(gather_bytes / (2 * samples), 1, pairs);
  Result<Scratch> scratch = Scratch::create(2 * std::uint64_t{samples} * group, options.scratch_directory);
  if (!scratch) return scratch.error();
  // Texels that are not stored are never written: they stay 0 from the beginning.
  auto* images = reinterpret_cast<std::uint16_t*>(scratch->data());
  std::mutex lock;
  std::size_t done = 0;
  for (std::size_t first = 0; first < pairs; first += group) {
    const std::size_t count = std::min(group, pairs - first);
    const Result<Done> rows = for_each_index(crop.height, [&](std::size_t y) -> Result<Done> {
      const std::string fault = gatherer.row(static_cast<std::uint32_t>(y), first, count, images);
      if (fault.empty()) return Done{};
      return bad_data(fmt::format("'{}': {}", file.path(), fault));
    });
    if (!rows) return rows.error();
    tbb::parallel_for(std::size_t{0}, count, [&](std::size_t i) {
      dataset.write_image(first + i, std::span<const std::uint16_t>(images + i * samples, samples));
      const std::lock_guard<std::mutex> hold(lock);
      if (options.progress) options.progress(++done, pairs);
    });
  }
  return Done{};
}

}  // namespace btfc
