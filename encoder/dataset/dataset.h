// A measured or synthetic BTF as every model and measure sees it: images of one tile under pairs of
// directions, on scratch space, read by image or by texel.
#pragma once
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "encoder/dataset/direction.h"
#include "encoder/dataset/scratch.h"
#include "encoder/image.h"
#include "format/head.h"
#include "format/result.h"

namespace btfc {

inline constexpr std::uint32_t kMaxDatasetChannels = 256;

// Indices into DatasetInfo::views and lights.
struct DirectionPair {
  std::uint32_t view = 0, light = 0;
  bool operator==(const DirectionPair&) const = default;
};

// All but the samples. A reflectance field is a BTF with one view.
struct DatasetInfo {
  std::uint32_t width = 0, height = 0;  // texels of a tile, 1 … 65536
  std::vector<std::string> channels;    // their names, "R" "G" "B", or wavelengths in nanometres "550.5"
  SampleType type = SampleType::unorm8;
  ColourSpace colour_space = ColourSpace::unknown;
  Quantity quantity = Quantity::unspecified;  // reflectance_cos: the light's cosine is multiplied in
  bool wraps = false;                         // the tile repeats without seams
  std::vector<Direction> views, lights;
  std::vector<DirectionPair> pairs;  // one an image, none twice, ordered by view, then light
  // How much each pair's squared error counts in fits and measures, above 0, with mean 1; empty: all alike.
  std::vector<double> weights;

  std::uint32_t channel_count() const { return static_cast<std::uint32_t>(channels.size()); }
  // Whether every view has every light.
  bool full_product() const { return pairs.size() == views.size() * lights.size(); }
  double weight(std::size_t pair) const { return weights.empty() ? 1.0 : weights[pair]; }
  // Samples of one image.
  std::size_t image_samples() const { return std::size_t{width} * height * channels.size(); }
};

// pairs = all of views x lights.
void make_full_product(DatasetInfo& info);

// One image of such a set, of info.image_samples() codes: all channels, no alpha.
Image image_of(const DatasetInfo& info, std::vector<std::uint16_t> codes);

// Codes are those of Image. Reading is thread-safe; so is writing different images. The samples lie in bands
// of rows, in each band all pairs one after another: an image is read in pieces of about a page, and all
// pairs of a texel lie within one band.
class Dataset {
 public:
  // Samples are 0 until written. Refused: sizes out of range, no channels or pairs, pairs that name no
  // direction or come twice or out of order, directions below the surface.
  static Result<Dataset> create(DatasetInfo info, const std::string& scratch_directory);

  const DatasetInfo& info() const { return info_; }
  std::uint64_t scratch_bytes() const { return scratch_.size(); }

  // Whole images: info().image_samples() codes, rows from the top, channels interleaved.
  void write_image(std::size_t pair, std::span<const std::uint16_t> codes);
  void read_image(std::size_t pair, std::span<std::uint16_t> codes) const;
  // The same as an Image (all channels, no alpha).
  Image image(std::size_t pair) const;

  // Texels x … x+count-1 of row y under all pairs: codes[(t * pairs + pair) * channels + channel].
  void read_texels(std::uint32_t x, std::uint32_t y, std::uint32_t count,
                   std::span<std::uint16_t> codes) const;

  std::uint16_t code(std::size_t pair, std::uint32_t x, std::uint32_t y, std::uint32_t channel) const {
    const std::uint8_t* row = row_data(pair, y);
    const std::size_t i = std::size_t{x} * info_.channels.size() + channel;
    return bytes_ == 1 ? row[i] : reinterpret_cast<const std::uint16_t*>(row)[i];
  }

 private:
  Dataset(DatasetInfo info, Scratch scratch, std::uint32_t band_rows)
      : info_(std::move(info)),
        scratch_(std::move(scratch)),
        band_rows_(band_rows),
        bytes_(info_.type == SampleType::unorm8 ? 1 : 2),
        row_bytes_(std::size_t{info_.width} * info_.channels.size() * bytes_) {}
  std::uint8_t* row_data(std::size_t pair, std::uint32_t y) const;

  DatasetInfo info_;
  Scratch scratch_;
  std::uint32_t band_rows_;
  std::size_t bytes_, row_bytes_;
};

}  // namespace btfc
