// Chunks, words and sizes of model patch.
#include "format/models/patch_payload.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstring>

#include "format/checked.h"
#include "format/limits.h"
#include "shaders/models/patch.h"

namespace btfc {
namespace {

constexpr std::uint32_t kSmpl = four_cc("SMPL"), kTrim = four_cc("TRIM"), kCoor = four_cc("COOR"),
                        kCutV = four_cc("CUTV"), kCutH = four_cc("CUTH");
constexpr std::uint32_t kChunkTypes[] = {kCoor, kCutH, kCutV, kSmpl, kTrim};
constexpr std::uint64_t kParmBytes = 32;
constexpr std::uint32_t kBlockSide = 4, kBlockTexels = 16;

unsigned entry_bits(const PatchShape& s) { return s.overlap == 0 ? 0 : ceil_log2(s.overlap); }

// Bits of one entry, and from one cut to the next, as they lie in memory.
std::uint32_t stored_entry_bits(const PatchShape& s) {
  return s.cuts == CutLayout::rgba8 ? 8 : entry_bits(s);
}
std::uint64_t cut_stride_bits(const PatchShape& s) {
  return s.cuts == CutLayout::rgba8 ? 32 * ceil_div(s.size, 4) : std::uint64_t{s.size} * entry_bits(s);
}

CheckedSize coordinate_bytes(const PatchShape& s) {
  const CheckedSize patches = CheckedSize(s.count_x) * CheckedSize(s.count_y);
  return CheckedSize(4) * (s.wide_coordinates() ? patches : ceil_div(patches, 2));
}
CheckedSize cut_bytes(const PatchShape& s, std::uint64_t cuts) {
  return CheckedSize(4) * ceil_div(CheckedSize(cuts) * CheckedSize(cut_stride_bits(s)), 32);
}
std::uint64_t stored_texels(const PatchShape& s) {
  return s.stored_blocks != 0 ? std::uint64_t{kBlockTexels} * s.stored_blocks
                              : std::uint64_t{s.sample_width} * s.sample_height;
}
CheckedSize sample_bytes(const PatchShape& s, const Map& map) {
  return CheckedSize(stored_texels(s)) * CheckedSize(map.channels * sample_bits(map.type) / 8);
}
std::uint64_t trim_bytes(const PatchShape& s) {
  return s.stored_blocks == 0 ? 0 : 4 * ceil_div(std::uint64_t{s.blocks_x()} * s.blocks_y(), 32);
}

std::uint32_t padded_texel_bits(const Map& map) {
  return sample_bits(map.type) * (map.channels == 3 ? 4 : map.channels);
}
std::uint64_t plane_words(const PatchShape& s, const Map& map) {
  return ceil_div(std::uint64_t{s.sample_width} * s.sample_height * padded_texel_bits(map), 32);
}

// PARM and every array that is not empty.
std::vector<ChunkSpec> payload_chunks(const PatchShape& s, std::span<const Map> maps) {
  std::vector<ChunkSpec> chunks = {{{kParm, kPayloadChunk}, kParmBytes}};
  const auto add = [&](std::uint32_t type, std::uint8_t part, CheckedSize bytes) {
    if (bytes.saturated() != 0) chunks.push_back({{type, kPayloadChunk, 0, part}, bytes.saturated()});
  };
  add(kCoor, 0, coordinate_bytes(s));
  add(kCutV, 0, cut_bytes(s, s.cuts_v()));
  add(kCutH, 0, cut_bytes(s, s.cuts_h()));
  add(kTrim, 0, trim_bytes(s));
  for (std::size_t i = 0; i < maps.size(); ++i)
    add(kSmpl, static_cast<std::uint8_t>(i), sample_bytes(s, maps[i]));
  std::sort(chunks.begin(), chunks.end(),
            [](const ChunkSpec& a, const ChunkSpec& b) { return a.key.order() < b.key.order(); });
  return chunks;
}

Bytes pack_positions(const PatchShape& s, const std::vector<PatchPosition>& positions) {
  Bytes raw(coordinate_bytes(s).value());
  for (std::size_t p = 0; p < positions.size(); ++p) {
    if (s.wide_coordinates()) {
      store_u16(&raw[4 * p], static_cast<std::uint16_t>(positions[p].x));
      store_u16(&raw[4 * p + 2], static_cast<std::uint16_t>(positions[p].y));
    } else {
      raw[2 * p] = static_cast<std::uint8_t>(positions[p].x);
      raw[2 * p + 1] = static_cast<std::uint8_t>(positions[p].y);
    }
  }
  return raw;
}

Bytes pack_cuts(const PatchShape& s, const std::vector<std::uint16_t>& entries, std::uint64_t cuts) {
  std::vector<std::uint32_t> words(cut_bytes(s, cuts).value() / 4);
  const std::uint32_t bits = stored_entry_bits(s);
  for (std::uint64_t c = 0; c < cuts && bits != 0; ++c) {
    for (std::uint32_t t = 0; t < s.size; ++t) {
      const std::uint64_t bit = c * cut_stride_bits(s) + std::uint64_t{t} * bits;
      const std::uint64_t value = std::uint64_t{entries[c * s.size + t]} << (bit & 31);
      words[bit >> 5] |= static_cast<std::uint32_t>(value);
      if (value >> 32 != 0) words[(bit >> 5) + 1] |= static_cast<std::uint32_t>(value >> 32);
    }
  }
  return from_words(words);
}

// The sample's texel of each stored texel, in the order of SMPL; -1 outside the sample. Empty for a sample
// that is stored whole, where the order is the sample's own.
std::vector<std::int64_t> stored_order(const PatchShape& s, const std::vector<bool>& blocks) {
  std::vector<std::int64_t> order;
  if (s.stored_blocks == 0) return order;
  order.reserve(stored_texels(s));
  for (std::uint32_t b = 0; b < blocks.size(); ++b) {
    if (!blocks[b]) continue;
    for (std::uint32_t t = 0; t < kBlockTexels; ++t) {
      const std::uint32_t x = b % s.blocks_x() * kBlockSide + t % kBlockSide;
      const std::uint32_t y = b / s.blocks_x() * kBlockSide + t / kBlockSide;
      const bool inside = x < s.sample_width && y < s.sample_height;
      order.push_back(inside ? std::int64_t{y} * s.sample_width + x : -1);
    }
  }
  return order;
}

Bytes pack_blocks(const PatchShape& s, const std::vector<bool>& blocks) {
  Bytes raw(trim_bytes(s));
  for (std::size_t b = 0; b < blocks.size(); ++b) {
    if (blocks[b]) raw[b / 8] = static_cast<std::uint8_t>(raw[b / 8] | 1u << (b % 8));
  }
  return raw;
}

Bytes pack_sample(const PatchShape& s, const Map& map, const SampleCodes& codes,
                  const std::vector<bool>& blocks) {
  const std::uint32_t bytes = sample_bits(map.type) / 8;
  Bytes raw(sample_bytes(s, map).value());
  std::uint8_t* to = raw.data();
  const std::vector<std::int64_t> order = stored_order(s, blocks);
  for (std::size_t i = 0; i < stored_texels(s); ++i) {
    const std::int64_t q = order.empty() ? static_cast<std::int64_t>(i) : order[i];
    for (std::uint32_t c = 0; c < map.channels; ++c, to += bytes) {
      const std::uint16_t code =
          q < 0 ? std::uint16_t{0} : codes[static_cast<std::size_t>(q) * map.channels + c];
      if (bytes == 1) {
        *to = static_cast<std::uint8_t>(code);
      } else {
        store_u16(to, code);
      }
    }
  }
  return raw;
}

// TRIM -> which blocks are stored. Rule PA9.
Result<std::vector<bool>> unpack_blocks(const PatchShape& s, ByteView raw) {
  std::vector<bool> blocks(std::size_t{s.blocks_x()} * s.blocks_y());
  std::uint32_t count = 0;
  for (std::size_t b = 0; b < 8 * raw.size(); ++b) {
    if ((raw[b / 8] >> (b % 8) & 1) == 0) continue;
    if (b >= blocks.size()) return invalid("PA9", 0, "TRIM has bits set beyond the sample's blocks");
    blocks[b] = true;
    ++count;
  }
  if (count != s.stored_blocks) {
    return invalid("PA9", 0,
                   fmt::format("TRIM has {} bits set, expected stored_blocks = {}", count, s.stored_blocks));
  }
  return blocks;
}

// Rule PA6.
std::optional<Error> position_fault(const PatchShape& s, const PatchParams& params, const BtfcWords& words) {
  for (std::uint32_t j = 0; j < s.count_y; ++j) {
    for (std::uint32_t i = 0; i < s.count_x; ++i) {
      const uvec2 at = patch_coordinates(words, params, i, j);
      if (at.x > s.sample_width - s.size || at.y > s.sample_height - s.size) {
        return invalid("PA6", 0,
                       fmt::format("patch ({}, {}) lies at ({}, {}), expected at most ({}, {})", i, j, at.x,
                                   at.y, s.sample_width - s.size, s.sample_height - s.size));
      }
    }
  }
  if (!s.wide_coordinates() && s.patches() % 2 == 1) {
    const std::uint64_t last = s.patches() / 2;
    if (words.slot[PATCH_COORDINATES][last] >> 16 != 0)
      return invalid("PA6", 0, "the padding of COOR is not 0");
  }
  return std::nullopt;
}

// Rule PA7: walks entries and, by rebuilding what a writer would write, the padding.
std::optional<Error> cut_fault(const PatchShape& s, const PatchParams& params, const BtfcWords& words,
                               std::uint32_t slot, std::uint64_t cuts, std::size_t word_count) {
  std::vector<std::uint32_t> rebuilt(word_count);
  for (std::uint64_t c = 0; c < cuts && params.cut_bits != 0; ++c) {
    for (std::uint32_t t = 0; t < s.size; ++t) {
      const std::uint32_t entry = patch_cut(words, params, slot, static_cast<std::uint32_t>(c), t);
      if (entry >= s.overlap) {
        return invalid("PA7", 0,
                       fmt::format("entry {} of cut {} in {} is {}, expected below {}", t, c,
                                   slot == PATCH_CUTS_V ? "CUTV" : "CUTH", entry, s.overlap));
      }
      const std::uint64_t bit = c * params.cut_stride + std::uint64_t{t} * params.cut_bits;
      const std::uint64_t value = std::uint64_t{entry} << (bit & 31);
      rebuilt[bit >> 5] |= static_cast<std::uint32_t>(value);
      if (value >> 32 != 0) rebuilt[(bit >> 5) + 1] |= static_cast<std::uint32_t>(value >> 32);
    }
  }
  if (!std::equal(rebuilt.begin(), rebuilt.end(), words.slot[slot])) {
    return invalid("PA7", 0,
                   fmt::format("the padding of {} is not 0", slot == PATCH_CUTS_V ? "CUTV" : "CUTH"));
  }
  return std::nullopt;
}

// SMPL -> texels padded to a power of two of bits. Rules PA8 and PA9 on the way.
Result<Done> append_plane(const PatchShape& s, const Map& map, ByteView raw,
                          const std::vector<std::int64_t>& order, std::vector<std::uint32_t>& words) {
  const std::size_t first = words.size();
  words.resize(first + plane_words(s, map));
  const std::uint32_t bits = sample_bits(map.type), texel_bits = padded_texel_bits(map);
  for (std::size_t i = 0; i < stored_texels(s); ++i) {
    const std::uint64_t q = order.empty() ? i : static_cast<std::uint64_t>(order[i]);
    for (std::uint32_t c = 0; c < map.channels; ++c) {
      const std::size_t at = i * map.channels + c;
      const std::uint32_t code = bits == 8 ? raw[at] : load_u16(&raw[2 * at]);
      if (static_cast<std::int64_t>(q) < 0) {
        if (code != 0)
          return invalid("PA9", 0,
                         fmt::format("map '{}' has a code outside the sample that is not 0", map.name));
        continue;
      }
      if (map.type == SampleType::float16 && (code & 0x7c00u) == 0x7c00u) {
        return invalid("PA8", 0,
                       fmt::format("sample of map '{}' is not finite at ({}, {}) channel {}", map.name,
                                   q % s.sample_width, q / s.sample_width, c));
      }
      const std::uint64_t bit = q * texel_bits + std::uint64_t{c} * bits;
      words[first + (bit >> 5)] |= code << (bit & 31);
    }
  }
  return Done{};
}

// Of a texel where as many patches meet as ever do (spec/models/patch.md section 7).
TexelCost patch_cost(const PatchShape& s, const Map& map) {
  const bool across = s.overlap > 0 && (s.wraps || s.count_x > 1);
  const bool down = s.overlap > 0 && (s.wraps || s.count_y > 1);
  const std::uint64_t texel_words = 1 + (padded_texel_bits(map) > 32 ? 1 : 0);
  const bool halves = map.type == SampleType::float16;
  const std::uint64_t values = halves ? 0 : 4;
  if (s.blend == PatchBlend::liang) {
    const std::uint64_t patches = (across ? 2u : 1u) * (down ? 2u : 1u);
    return {values + (halves ? 16 * (patches - 1) : 0), patches * (1 + texel_words)};
  }
  const std::uint32_t bits = stored_entry_bits(s);
  const std::uint64_t entry_words = bits == 0 ? 0 : 32 % bits == 0 ? 1 : 2;
  return {values, entry_words * (across && down ? 3 : across || down ? 1 : 0) + 1 + texel_words};
}

}  // namespace

const std::span<const std::uint32_t> kPatchChunkTypes = kChunkTypes;

Result<Done> check_patch_shape(const PatchShape& s, const Head& head) {
  if (s.sample_width < 2 || s.sample_height < 2 || s.sample_width > kMaxSide || s.sample_height > kMaxSide) {
    return invalid(
        "PA1", 0,
        fmt::format("sample is {}x{}, expected 2 to 65536 a side", s.sample_width, s.sample_height));
  }
  const std::uint32_t largest = std::min(s.sample_width, s.sample_height);
  if (s.size < 2 || s.size > largest) {
    return invalid("PA1", 0,
                   fmt::format("patch size w_B is {}, a sample of {}x{} allows 2 to {}", s.size,
                               s.sample_width, s.sample_height, largest));
  }
  if (s.count_x < 1 || s.count_y < 1 || s.count_x > kMaxSide || s.count_y > kMaxSide) {
    return invalid("PA1", 0, fmt::format("{}x{} patches, expected 1 to 65536 a side", s.count_x, s.count_y));
  }
  const bool single = s.count_x == 1 && s.count_y == 1 && !s.wraps;
  if (s.overlap > s.size / 2 || (s.overlap == 0 && !single)) {
    return invalid("PA1", 0,
                   fmt::format("overlap w_E is {}, patches of {} texels allow {} to {}", s.overlap, s.size,
                               single ? 0 : 1, s.size / 2));
  }
  if ((s.blend == PatchBlend::liang) != (s.cuts == CutLayout::none)) {
    return invalid("PA2", 0, "cut layout and blend do not fit: liang stores no cuts, quilting does");
  }
  if (s.cuts == CutLayout::rgba8 && s.overlap > 256) {
    return invalid("PA2", 0,
                   fmt::format("overlap w_E is {}, the rgba8 layout allows at most 256", s.overlap));
  }
  const auto fits = [&](std::uint32_t side, std::uint64_t full, std::uint32_t count) {
    return s.wraps ? side == full : side <= full && std::uint64_t{count - 1} * s.step() < side;
  };
  if (!fits(head.width, s.full_width(), s.count_x) || !fits(head.height, s.full_height(), s.count_y)) {
    return invalid(
        "PA3", 0,
        fmt::format("{}x{} patches of {} texels with overlap {} make {}x{} texels and do not fit a "
                    "texture of {}x{}",
                    s.count_x, s.count_y, s.size, s.overlap, s.full_width(), s.full_height(), head.width,
                    head.height));
  }
  if (head.views != 1 || head.lights != 1 || head.pairs != 1 || head.wrap_u != head.wrap_v ||
      head.unbounded) {
    return invalid(
        "PA4", 0,
        "HEAD gives directions, wrapping in one direction or an unbounded texture, which patch has not");
  }
  if (s.stored_blocks >= std::uint64_t{s.blocks_x()} * s.blocks_y()) {
    return invalid(
        "PA9", 0,
        fmt::format("stored_blocks is {}, a sample of {}x{} texels has {} and is then stored whole",
                    s.stored_blocks, s.sample_width, s.sample_height,
                    std::uint64_t{s.blocks_x()} * s.blocks_y()));
  }
  for (const ChunkSpec& chunk : payload_chunks(s, head.maps)) {
    if (chunk.raw_bytes > kMaxChunkBytes) {
      return invalid("PA5", 0,
                     fmt::format("chunk '{}' would have {} bytes, expected at most 2^27",
                                 type_name(chunk.key.type), chunk.raw_bytes));
    }
  }
  std::uint64_t planes = 0;
  for (const Map& map : head.maps) planes += 4 * plane_words(s, map);
  if (planes > kMaxChunkBytes) {
    return invalid("PA5", 0,
                   fmt::format("the maps' planes would have {} bytes, expected at most 2^27", planes));
  }
  return Done{};
}

Bytes write_patch_parm(const PatchShape& s) {
  Bytes parm(kParmBytes);
  const std::uint32_t fields[] = {s.sample_width, s.sample_height, s.count_x, s.count_y, s.size, s.overlap};
  for (std::size_t i = 0; i < std::size(fields); ++i) store_u32(&parm[4 * i], fields[i]);
  parm[24] = static_cast<std::uint8_t>(s.blend);
  parm[25] = static_cast<std::uint8_t>(s.cuts);
  store_u32(&parm[28], s.stored_blocks);
  return parm;
}

Result<PatchShape> read_patch_parm(ByteView parm, const Head& head) {
  if (parm.size() != kParmBytes) {
    return invalid("PA1", 0, fmt::format("PARM has {} bytes, expected {}", parm.size(), kParmBytes));
  }
  if (parm[24] > 1 || load_u16(&parm[26]) != 0) {
    return invalid("PA1", 0, "PARM has an unknown blend or a reserved field that is not 0");
  }
  if (parm[25] > 2)
    return invalid("PA1", 0, fmt::format("PARM has cut layout {}, expected 0 to 2", parm[25]));
  PatchShape s;
  s.sample_width = load_u32(&parm[0]);
  s.sample_height = load_u32(&parm[4]);
  s.count_x = load_u32(&parm[8]);
  s.count_y = load_u32(&parm[12]);
  s.size = load_u32(&parm[16]);
  s.overlap = load_u32(&parm[20]);
  s.blend = static_cast<PatchBlend>(parm[24]);
  s.cuts = static_cast<CutLayout>(parm[25]);
  s.stored_blocks = load_u32(&parm[28]);
  s.wraps = head.wrap_u == Wrap::repeat && head.wrap_v == Wrap::repeat;
  if (const Result<Done> checked = check_patch_shape(s, head); !checked) return checked.error();
  return s;
}

std::uint64_t patch_map_bits(const PatchShape& s, const Map& map) {
  return stored_texels(s) * map.channels * sample_bits(map.type);
}

std::uint64_t patch_formula_bits(const PatchShape& s, std::span<const Map> maps) {
  std::uint64_t bits = 8 * kParmBytes;
  for (const Map& map : maps) bits += patch_map_bits(s, map);
  if (s.stored_blocks != 0) bits += 32 * ceil_div(std::uint64_t{s.blocks_x()} * s.blocks_y(), 32);
  bits += 32 * (s.wide_coordinates() ? s.patches() : ceil_div(s.patches(), 2));
  for (const std::uint64_t cuts : {s.cuts_v(), s.cuts_h()}) {
    if (s.cuts == CutLayout::rgba8) bits += 32 * cuts * ceil_div(s.size, 4);
    if (s.cuts == CutLayout::packed) bits += 32 * ceil_div(cuts * s.size * entry_bits(s), 32);
  }
  return bits;
}

std::uint64_t patch_memory_bits(const PatchShape& s, std::span<const Map> maps) {
  std::uint64_t bits =
      8 * (coordinate_bytes(s).value() + cut_bytes(s, s.cuts_v()).value() + cut_bytes(s, s.cuts_h()).value());
  for (const Map& map : maps) bits += 32 * plane_words(s, map);
  return bits;
}

// The paper's section V, for any number of channels, sample widths and patches a side.
std::uint64_t patch_paper_bits(const PatchShape& s, std::span<const Map> maps) {
  std::uint64_t bits = 64 + (s.wide_coordinates() ? 32 : 16) * s.patches();
  for (const Map& map : maps) bits += patch_map_bits(s, map);
  return bits + (s.cuts_v() + s.cuts_h()) * s.size * entry_bits(s);
}

std::vector<RawChunk> patch_write(const Head& head, const PatchShape& s, const PatchRecipe& recipe,
                                  std::span<const SampleCodes> samples) {
  std::vector<RawChunk> chunks = {{{kHead, kCritical}, write_head(head)}};
  for (const ChunkSpec& spec : payload_chunks(s, head.maps)) {
    Bytes raw;
    if (spec.key.type == kParm) raw = write_patch_parm(s);
    if (spec.key.type == kCoor) raw = pack_positions(s, recipe.positions);
    if (spec.key.type == kCutV) raw = pack_cuts(s, recipe.cuts_v, s.cuts_v());
    if (spec.key.type == kCutH) raw = pack_cuts(s, recipe.cuts_h, s.cuts_h());
    if (spec.key.type == kTrim) raw = pack_blocks(s, recipe.blocks);
    if (spec.key.type == kSmpl) {
      raw = pack_sample(s, head.maps[spec.key.part], samples[spec.key.part], recipe.blocks);
    }
    chunks.push_back({spec.key, std::move(raw)});
  }
  return chunks;
}

Result<Layout> patch_layout(const Head& head, ByteView parm) {
  const Result<PatchShape> shape = read_patch_parm(parm, head);
  if (!shape) return shape.error();
  const PatchShape& s = *shape;
  Layout layout;
  layout.chunks = payload_chunks(s, head.maps);
  layout.formula_bits = patch_formula_bits(s, head.maps);
  layout.memory_bits = patch_memory_bits(s, head.maps);
  layout.paper = PaperCount{
      "Brayner, Walter: Compression of Synthesized Textures, section V", patch_paper_bits(s, head.maps), {}};
  const auto add = [&](const char* name, std::uint64_t value) {
    layout.parameters.push_back({name, std::to_string(value), true});
  };
  add("sample_width", s.sample_width);
  add("sample_height", s.sample_height);
  add("k_x", s.count_x);
  add("k_y", s.count_y);
  add("w_b", s.size);
  add("w_e", s.overlap);
  add("stored_blocks", s.stored_blocks);
  layout.parameters.push_back({"blend", s.blend == PatchBlend::liang ? "liang" : "quilting", false});
  constexpr const char* kLayouts[] = {"none", "rgba8", "packed"};
  layout.parameters.push_back({"pack", kLayouts[static_cast<std::size_t>(s.cuts)], false});
  layout.parameters.push_back({"wraps", s.wraps ? "yes" : "no", false});
  layout.cost = patch_cost(s, head.maps[0]);
  for (const Map& map : head.maps) layout.map_bits.push_back(patch_map_bits(s, map));
  return layout;
}

Result<LoadedItem> patch_load(const Head& head, ByteView parm, const ChunkReader& read, std::uint32_t) {
  const Result<PatchShape> shape = read_patch_parm(parm, head);
  if (!shape) return shape.error();
  const PatchShape& s = *shape;
  LoadedItem item;
  item.head = head;
  std::vector<bool> blocks;
  if (s.stored_blocks != 0) {
    const Result<Bytes> raw = read({kTrim, kPayloadChunk});
    if (!raw) return raw.error();
    Result<std::vector<bool>> unpacked = unpack_blocks(s, *raw);
    if (!unpacked) return unpacked.error();
    blocks = *std::move(unpacked);
  }
  const std::vector<std::int64_t> order = stored_order(s, blocks);
  for (const ChunkSpec& spec : payload_chunks(s, head.maps)) {
    if (spec.key.type == kParm || spec.key.type == kTrim) continue;
    const Result<Bytes> raw = read(spec.key);
    if (!raw) return raw.error();
    if (spec.key.type == kCoor) item.words[PATCH_COORDINATES] = to_words(*raw);
    if (spec.key.type == kCutV) item.words[PATCH_CUTS_V] = to_words(*raw);
    if (spec.key.type == kCutH) item.words[PATCH_CUTS_H] = to_words(*raw);
    if (spec.key.type == kSmpl) {  // SMPL chunks come in the maps' order
      const Map& map = head.maps[spec.key.part];
      item.planes.push_back({s.sample_width, s.sample_height, map.channels, padded_texel_bits(map), map.type,
                             PATCH_SAMPLE, static_cast<std::uint32_t>(item.words[PATCH_SAMPLE].size())});
      if (const auto added = append_plane(s, map, *raw, order, item.words[PATCH_SAMPLE]); !added)
        return added.error();
    }
  }

  for (std::size_t m = 0; m < head.maps.size(); ++m) {
    const PatchParams params{head.width,
                             head.height,
                             s.wraps ? 1u : 0u,
                             s.sample_width,
                             s.count_x,
                             s.count_y,
                             s.size,
                             s.overlap,
                             static_cast<uint>(s.blend),
                             s.wide_coordinates() ? 1u : 0u,
                             s.cuts_v() + s.cuts_h() == 0 ? 0u : stored_entry_bits(s),
                             static_cast<uint>(cut_stride_bits(s)),
                             item.planes[m].first_word,
                             item.planes[m].texel_bits,
                             static_cast<uint>(head.maps[m].type)};
    std::vector<std::uint32_t> words(sizeof params / 4);
    std::memcpy(words.data(), &params, sizeof params);
    item.map_params.push_back(std::move(words));

    if (m != 0) continue;  // the recipe is common to all maps
    const BtfcWords view{
        {item.words[0].data(), item.words[1].data(), item.words[2].data(), item.words[3].data()}};
    if (auto fault = position_fault(s, params, view)) return *fault;
    if (auto fault = cut_fault(s, params, view, PATCH_CUTS_V, s.cuts_v(), item.words[PATCH_CUTS_V].size()))
      return *fault;
    if (auto fault = cut_fault(s, params, view, PATCH_CUTS_H, s.cuts_h(), item.words[PATCH_CUTS_H].size()))
      return *fault;
  }
  return item;
}

}  // namespace btfc
