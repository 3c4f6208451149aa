// From header and body to a data set.
#include "encoder/input/ubo2014_read.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <new>
#include <optional>

#include "encoder/input/read_selection.h"
#include "encoder/input/ubo2014_bdi.h"
#include "encoder/input/ubo2014_expand.h"

namespace btfc {
namespace {

DatasetInfo info_of(const Ubo2014Header& header, const Rectangle& crop) {
  DatasetInfo info;
  info.width = crop.width;
  info.height = crop.height;
  info.channels = header.channels;
  info.type = SampleType::float16;
  info.colour_space = header.rgb ? ColourSpace::lin_rec709_scene : ColourSpace::unknown;
  info.quantity = header.quantity;
  info.views = header.views;
  info.lights = header.lights;
  make_full_product(info);
  return info;
}

Ubo2014Factored read_factored(Ubo2014Cursor& cursor, Ubo2014Header& header) {
  if (header.body == Ubo2014Body::dfmf) return read_ubo2014_dfmf(cursor, header);
  if (header.body == Ubo2014Body::fmf) return read_ubo2014_fmf(cursor, header);
  return read_ubo2014_pvf(cursor, header);
}

Result<DatasetRead> read(const std::string& path, const DatasetReadOptions& options) {
  const Result<Ubo2014File> file = Ubo2014File::open(path);
  if (!file) return file.error();
  Ubo2014Cursor cursor(*file);
  Ubo2014Header header = read_ubo2014_header(cursor);
  if (cursor.failed()) return cursor.fault();
  const bool factored = header.body != Ubo2014Body::bdi;
  const Ubo2014Factored factors = factored ? read_factored(cursor, header) : Ubo2014Factored{};
  const Ubo2014Bdi bdi = factored ? Ubo2014Bdi{} : read_ubo2014_bdi(cursor, header);
  if (!cursor.failed() && cursor.left() > 0) {
    cursor.refuse(fmt::format("{} bytes follow the last field, expected none", cursor.left()));
  }
  if (cursor.failed()) return cursor.fault();

  const Result<Rectangle> crop = kept_texels(options, header.width, header.height, path);
  if (!crop) return crop.error();
  Result<Dataset> dataset = Dataset::create(info_of(header, *crop), options.scratch_directory);
  if (!dataset) return dataset.error();
  if (factored) {
    const Result<std::uint64_t> negative = expand_ubo2014(*file, header, factors, *crop, options, *dataset);
    if (!negative) return negative.error();
    if (*negative > 0) {
      header.notes.push_back(fmt::format("{} of {} values are below 0 and kept", *negative,
                                         dataset->info().image_samples() * header.pairs()));
    }
  } else if (const auto gathered = gather_ubo2014_bdi(*file, header, bdi, *crop, options, *dataset);
             !gathered) {
    return gathered.error();
  }
  // Matrices hold all pairs together: they are multiplied out whole.
  Result<Dataset> part = reduced_dataset(std::move(*dataset), options, path);
  if (!part) return part.error();
  return DatasetRead{std::move(*part), header.pairs(), "ubo2014", std::move(header.notes)};
}

}  // namespace

bool is_ubo2014(const std::string& path) {
  struct stat found {};
  if (stat(path.c_str(), &found) != 0 || !S_ISREG(found.st_mode)) return false;
  const int file = open(path.c_str(), O_RDONLY | O_CLOEXEC);
  if (file < 0) return false;
  std::uint8_t begin[16];
  const ssize_t got = ::read(file, begin, sizeof begin);
  close(file);
  return got > 0 && has_ubo2014_signature(ByteView(begin, static_cast<std::size_t>(got)));
}

Result<DatasetRead> read_ubo2014(const std::string& path, const DatasetReadOptions& options) {
  try {
    return read(path, options);
  } catch (const std::bad_alloc&) {
    return Error{Status::out_of_memory, fmt::format("no memory to read '{}'", path), "", 0};
  }
}

}  // namespace btfc
