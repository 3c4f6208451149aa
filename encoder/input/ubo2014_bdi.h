// BDI: apparent BRDFs one after another, each with all pairs of one texel.
#pragma once
#include <cstdint>
#include <string>
#include <vector>

#include "encoder/dataset/dataset.h"
#include "encoder/input/dataset_read.h"
#include "encoder/input/ubo2014_header.h"

namespace btfc {

// Where the apparent BRDFs lie: halves, channels fastest, then lights, then views. In a sparse file only
// those of texels whose mask is not 0 are stored.
struct Ubo2014Bdi {
  bool sparse = false;
  std::uint64_t mask = 0;                 // offset of one byte a texel
  std::uint64_t stored = 0;               // apparent BRDFs in the file
  std::uint64_t chunk_texels = 0;         // of them in a chunk, but for the last one
  std::uint64_t abrdf_bytes = 0;          // of each
  std::vector<std::uint64_t> row_begins;  // the number of the first stored one in a row of texels, and later
  std::vector<std::uint64_t> chunks;      // offsets of their halves
};

// The body behind the header, checked to fill the file to its end; notes go to the header. Faults are the
// cursor's. Compressed files (bzip) are not supported: how their halves lie before compression is not known.
Ubo2014Bdi read_ubo2014_bdi(Ubo2014Cursor& cursor, Ubo2014Header& header);

// Bytes of images that are gathered at once, on scratch space of their own.
inline constexpr std::uint64_t kUbo2014GatherBytes = std::uint64_t{2} << 30;

// The texels of `crop` onto a float16 data set of their size, whose pairs are the full product; texels that
// are not stored stay 0. The file is gone through once for each group of images that fit gather_bytes.
// Refused: halves that are not finite, the first one named.
Result<Done> gather_ubo2014_bdi(const Ubo2014File& file, const Ubo2014Header& header, const Ubo2014Bdi& body,
                                const Rectangle& crop, const DatasetReadOptions& options, Dataset& dataset,
                                std::uint64_t gather_bytes = kUbo2014GatherBytes);

}  // namespace btfc
