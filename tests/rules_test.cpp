// Every numbered rule of the spec: for each a file that breaks it and nothing before it, and the rule that is
// named.
#include <zstd.h>

#include <bit>
#include <fstream>
#include <regex>
#include <set>

#include "format/chunk_codec.h"
#include "format/domain.h"
#include "format/models/patch_payload.h"
#include "tests/test_support.h"

namespace btfc::test {
namespace {

// A file that each case damages: 3x3 patches of a 12x10 RGB sample, packed cuts, and META.
Bytes sound_file(OptionValues options = {{"wb", "8"}, {"we", "3"}, {"k", "3"}},
                 SampleType type = SampleType::unorm8, std::uint32_t width = 12) {
  FitResult result = fit("patch", noise(width, 10, 3, type), options);
  result.chunks.push_back({{kMeta, kSafeToCopy}, write_meta({{"a", "1"}, {"b", "2"}})});
  return pack(result);
}

// The same with a curve of two points.
Bytes measured_file() {
  FitResult result =
      fit("patch", noise(12, 10, 3, SampleType::unorm8), {{"wb", "8"}, {"we", "3"}, {"k", "3"}});
  QualityCurve curve;
  curve.measures = kQualityDistance | kQualityRate;
  curve.points.resize(2);
  curve.points[0].distance = 0.5f;
  curve.points[1].knobs.levels = 1;
  result.chunks.push_back({{kQual, 0}, write_quality(curve)});
  return pack(result);
}

std::size_t find(const Parts& parts, const char* type) {
  for (std::size_t i = 0; i < parts.entries.size(); ++i) {
    if (type_name(parts.entries[i].key.type) == type) return i;
  }
  ADD_FAILURE() << "no chunk " << type;
  return 0;
}

// Damages bytes of the file after it was laid out, and repairs the hashes unless the case is about them.
Bytes with_bytes(const std::function<void(Bytes&)>& edit, bool repair = true) {
  Bytes file = sound_file();
  edit(file);
  if (repair) repair_hashes(file);
  return file;
}

Bytes with_parts(const std::function<void(Parts&)>& edit, const Bytes& from = sound_file()) {
  Parts parts = take_apart(from);
  edit(parts);
  return put_together(parts);
}

Bytes with_chunk(const char* type, const std::function<void(Bytes&)>& edit,
                 const Bytes& from = sound_file()) {
  return with_parts([&](Parts& p) { edit(p.stored[find(p, type)]); }, from);
}

// HEAD and PARM fields, 32 bits each.
Bytes with_field(const char* type, std::size_t at, std::uint32_t value, const Bytes& from = sound_file()) {
  return with_chunk(
      type, [&](Bytes& raw) { store_u32(&raw[at], value); }, from);
}
Bytes with_byte(const char* type, std::size_t at, std::uint8_t value, const Bytes& from = sound_file()) {
  return with_chunk(
      type, [&](Bytes& raw) { raw[at] = value; }, from);
}

// SMPL as one zstd frame, then edited.
Bytes with_frame(const std::function<void(Bytes&)>& edit,
                 const std::function<void(ZSTD_CCtx*)>& configure = {}) {
  return with_parts([&](Parts& p) {
    const std::size_t i = find(p, "SMPL");
    Bytes& stored = p.stored[i];
    std::fill(stored.begin(), stored.end(), std::uint8_t{7});
    p.entries[i].raw_hash = content_hash(stored);
    ZSTD_CCtx* context = ZSTD_createCCtx();
    if (configure) configure(context);
    Bytes frame(ZSTD_compressBound(stored.size()));
    frame.resize(ZSTD_compress2(context, frame.data(), frame.size(), stored.data(), stored.size()));
    ZSTD_freeCCtx(context);
    stored = frame;
    p.entries[i].codec = Codec::zstd;
    edit(stored);
  });
}

// A frame that states `stated` bytes of content and whose only block, a run of one byte, holds `held`.
Bytes one_run_frame(std::uint32_t stated, std::uint32_t held) {
  Bytes z(12);
  store_u32(&z[0], 0xFD2FB528);
  z[4] = 0x60;  // single segment, two bytes of content size
  store_u16(&z[5], static_cast<std::uint16_t>(stated - 256));
  const std::uint32_t block = 1u | 1u << 1 | held << 3;  // last, run
  for (std::uint32_t i = 0; i < 3; ++i) z[7 + i] = static_cast<std::uint8_t>(block >> (8 * i));
  z[10] = 7;
  z.resize(11);
  return z;
}

// The sound file with a DOMN: views in a range, two lights listed; its bytes edited.
Bytes with_domain(const std::function<void(Bytes&)>& edit) {
  Domain domain;
  domain.views.kind = DomainKind::range;
  domain.views.range = {0.25f, 0.5f, 0, 1};
  domain.lights.kind = DomainKind::list;
  domain.lights.points = {{0, 0}, {1 << 20, 0}};
  Bytes raw = write_domain(domain);
  edit(raw);
  FitResult result =
      fit("patch", noise(12, 10, 3, SampleType::unorm8), {{"wb", "8"}, {"k", "3"}, {"we", "3"}});
  result.chunks.push_back({{kDomn, 0}, raw});
  return pack(result);
}
void store_float(Bytes& raw, std::size_t at, float v) {
  store_u32(&raw[at], std::bit_cast<std::uint32_t>(v));
}

struct Case {
  std::string name;
  const char* rule;
  std::function<Bytes()> file;
  Status status = Status::invalid_file;
};

std::vector<Case> cases() {
  const auto liang = [] { return sound_file({{"wb", "8"}, {"we", "3"}, {"k", "3"}, {"blend", "liang"}}); };
  // One patch at (5, 2) of a 13x10 sample of 4x3 blocks: nine blocks are shown, the last one among them.
  const auto trimmed = [] {
    PatchShape shape{13, 10, 1, 1, 8, 0, PatchBlend::liang, CutLayout::none, false, 9};
    PatchRecipe recipe;
    recipe.positions = {{5, 2}};
    for (int b = 0; b < 12; ++b) recipe.blocks.push_back(b % 4 != 0);
    Head head;
    head.width = head.height = 8;
    head.maps = {Map{}};
    const SampleCodes codes = noise(13, 10, 3, SampleType::unorm8).codes;
    FitResult result;
    result.chunks = patch_write(head, shape, recipe, {&codes, 1});
    return pack(result);
  };
  const auto rgba8 = [] { return sound_file({{"wb", "7"}, {"we", "3"}, {"k", "3"}, {"pack", "rgba8"}}); };
  std::vector<Case> all = {
      {"empty", "F1", [] { return Bytes(); }},
      {"63 bytes", "F1", [] { return Bytes(63, 0xAB); }},
      {"magic", "F2", [] { return with_bytes([](Bytes& f) { f[8] = '\n'; }); }},
      {"major", "F3", [] { return with_bytes([](Bytes& f) { f[12] = 1; }); }, Status::unsupported},
      {"minor", "F3", [] { return with_bytes([](Bytes& f) { f[14] = 2; }); }, Status::unsupported},
      {"feature", "F4", [] { return with_bytes([](Bytes& f) { f[19] = 0x80; }); }, Status::unsupported},
      {"no chunks", "F5", [] { return with_bytes([](Bytes& f) { store_u32(&f[24], 0); }); }},
      {"too many chunks", "F5", [] { return with_bytes([](Bytes& f) { store_u32(&f[24], 0xffffffff); }); }},
      {"index beyond the end", "F5",
       [] { return with_bytes([](Bytes& f) { store_u32(&f[24], 1u << 20); }); }},
      {"align 3", "F6", [] { return with_bytes([](Bytes& f) { store_u32(&f[28], 3); }); }},
      {"align 17", "F6", [] { return with_bytes([](Bytes& f) { store_u32(&f[28], 17); }); }},
      {"align huge", "F6", [] { return with_bytes([](Bytes& f) { store_u32(&f[28], 0xffffffff); }); }},
      {"file_bytes", "F7", [] { return with_bytes([](Bytes& f) { f[39] = 0x80; }); }},
      {"trailing byte", "F7", [] { return with_bytes([](Bytes& f) { f.push_back(0); }); }},
      {"header reserved", "F8", [] { return with_bytes([](Bytes& f) { f[48] = 1; }); }},
      {"directory hash", "F9", [] { return with_bytes([](Bytes& f) { f[56] ^= 1; }, false); }},
      {"index damaged", "F9", [] { return with_bytes([](Bytes& f) { f[100] ^= 1; }, false); }},
      {"flags", "D1", [] { return with_parts([](Parts& p) { p.entries[0].key.flags = 9; }); }},
      {"payload not critical", "D1",
       [] { return with_parts([](Parts& p) { p.entries[1].key.flags = kPayload; }); }},
      {"type", "D2", [] { return with_parts([](Parts& p) { p.entries[0].key.type = 0x20414141; }); }},
      {"codec", "D3",
       [] { return with_parts([](Parts& p) { p.entries[0].codec = static_cast<Codec>(2); }); }},
      {"raw_bytes 0", "D4", [] { return with_bytes([](Bytes& f) { store_u64(&f[64 + 24], 0); }); }},
      {"raw_bytes above 2^27", "D4",
       [] { return with_bytes([](Bytes& f) { store_u64(&f[64 + 24], (1u << 27) + 1); }); }},
      {"raw_bytes 2^64-1", "D4", [] { return with_bytes([](Bytes& f) { store_u64(&f[64 + 24], ~0ull); }); }},
      {"stored != raw", "D5", [] { return with_bytes([](Bytes& f) { store_u64(&f[64 + 16], 63); }); }},
      {"zstd not smaller", "D5", [] { return with_bytes([](Bytes& f) { f[64 + 6] = 1; }); }},
      {"order", "D6",
       [] {
         return with_parts([](Parts& p) {
           std::swap(p.entries[1], p.entries[2]);
           std::swap(p.stored[1], p.stored[2]);
         });
       }},
      {"repeated", "D6",
       [] {
         return with_parts([](Parts& p) {
           p.entries.insert(p.entries.begin(), p.entries[0]);
           p.stored.insert(p.stored.begin(), p.stored[0]);
         });
       }},
      {"item", "D7", [] { return with_parts([](Parts& p) { p.entries.back().key.item = 1; }); }},
      {"offset", "D8", [] { return with_bytes([](Bytes& f) { f[64 + 8] ^= 16; }); }},
      {"offset 2^64-1", "D8", [] { return with_bytes([](Bytes& f) { store_u64(&f[64 + 8], ~0ull); }); }},
      {"gap at the end", "D9",
       [] {
         return with_bytes([](Bytes& f) {
           f.push_back(0);
           store_u64(&f[32], f.size());
         });
       }},
      {"payload_bytes", "D10", [] { return with_bytes([](Bytes& f) { f[40] ^= 1; }); }},
      {"unknown critical chunk", "D11",
       [] {
         return with_parts([](Parts& p) {
           p.entries.insert(p.entries.begin(), {{four_cc("ABCD"), kCritical}, Codec::raw, 0, 0, 0, 0});
           p.stored.insert(p.stored.begin(), Bytes(5));
         });
       },
       Status::unsupported},
      {"no HEAD", "D12",
       [] {
         return with_parts([](Parts& p) {
           p.entries.erase(p.entries.begin());
           p.stored.erase(p.stored.begin());
         });
       }},
      {"no PARM", "D12",
       [] {
         return with_parts([](Parts& p) {
           const std::size_t i = find(p, "PARM");
           p.entries.erase(p.entries.begin() + static_cast<long>(i));
           p.stored.erase(p.stored.begin() + static_cast<long>(i));
         });
       }},
      {"no SMPL", "D12",
       [] {
         return with_parts([](Parts& p) {
           const std::size_t i = find(p, "SMPL");
           p.entries.erase(p.entries.begin() + static_cast<long>(i));
           p.stored.erase(p.stored.begin() + static_cast<long>(i));
         });
       }},
      {"large HEAD", "D12", [] { return with_chunk("HEAD", [](Bytes& raw) { raw.resize(577); }); }},
      {"large PARM", "D12", [] { return with_chunk("PARM", [](Bytes& raw) { raw.resize(4097); }); }},
      {"short SMPL", "D12", [] { return with_chunk("SMPL", [](Bytes& raw) { raw.pop_back(); }); }},
      {"long COOR", "D12", [] { return with_chunk("COOR", [](Bytes& raw) { raw.resize(raw.size() + 4); }); }},
      {"extra map chunk", "D12",
       [] {
         return with_parts([](Parts& p) {
           const std::size_t i = find(p, "SMPL");
           p.entries.insert(p.entries.begin() + static_cast<long>(i) + 1, p.entries[i]);
           p.stored.insert(p.stored.begin() + static_cast<long>(i) + 1, p.stored[i]);
           p.entries[i + 1].key.part = 1;
         });
       }},
      {"META critical", "D12",
       [] {
         return with_parts([](Parts& p) {
           const std::size_t i = find(p, "META");
           p.entries[i].key.flags = kCritical;
           std::rotate(p.entries.begin() + 1, p.entries.end() - 1, p.entries.end());
           std::rotate(p.stored.begin() + 1, p.stored.end() - 1, p.stored.end());
         });
       }},
      {"META part 1", "D12",
       [] { return with_parts([](Parts& p) { p.entries[find(p, "META")].key.part = 1; }); }},
      {"padding", "P1",
       [] {
         return with_bytes([](Bytes& f) { f[load_u64(&f[64 + 48 + 8]) + load_u64(&f[64 + 48 + 16])] = 1; });
       }},
      {"no frame", "C1", [] { return with_frame([](Bytes& z) { z[0] ^= 1; }); }},
      {"skippable frame", "C1", [] { return with_frame([](Bytes& z) { store_u32(&z[0], 0x184D2A50); }); }},
      {"frame size lies", "C1", [] { return with_frame([](Bytes& z) { z[5] ^= 1; }); }},
      {"two frames", "C1",
       [] {
         return with_frame([](Bytes& z) {
           const Bytes once = z;
           z.insert(z.end(), once.begin(), once.end());
         });
       }},
      {"trailing bytes", "C1", [] { return with_frame([](Bytes& z) { z.push_back(0); }); }},
      {"truncated frame", "C1", [] { return with_frame([](Bytes& z) { z.pop_back(); }); }},
      {"checksum", "C1",
       [] {
         return with_frame([](Bytes&) {},
                           [](ZSTD_CCtx* c) { ZSTD_CCtx_setParameter(c, ZSTD_c_checksumFlag, 1); });
       }},
      {"no content size", "C1",
       [] {
         return with_frame([](Bytes&) {},
                           [](ZSTD_CCtx* c) { ZSTD_CCtx_setParameter(c, ZSTD_c_contentSizeFlag, 0); });
       }},
      {"reserved bit", "C1", [] { return with_frame([](Bytes& z) { z[4] |= 8; }); }},
      {"dictionary", "C1",
       [] {
         return with_frame([](Bytes& z) {
           z[4] |= 1;
           z.insert(z.begin() + 5, 9);
         });
       }},
      {"blocks hold another size", "C2",
       [] { return with_frame([](Bytes& z) { z = one_run_frame(360, 100); }); }},
      {"content hash", "C3", [] { return with_bytes([](Bytes& f) { f.back() ^= 1; }, false); }},
      {"HEAD size", "H1", [] { return with_byte("HEAD", 24, 2); }},
      {"HEAD too short", "H1", [] { return with_chunk("HEAD", [](Bytes& raw) { raw.resize(31); }); }},
      {"reserved model", "H2", [] { return with_field("HEAD", 0, 11); }, Status::unsupported},
      {"unknown model", "H2", [] { return with_field("HEAD", 0, 77); }, Status::unsupported},
      {"width 0", "H3", [] { return with_field("HEAD", 4, 0); }},
      {"height 65537", "H3", [] { return with_field("HEAD", 8, 65537); }},
      {"views 0", "H3", [] { return with_field("HEAD", 12, 0); }},
      {"lights", "H3", [] { return with_field("HEAD", 16, 65537); }},
      {"pairs", "H3", [] { return with_field("HEAD", 20, (1u << 20) + 1); }},
      {"no maps", "H3",
       [] {
         return with_chunk("HEAD", [](Bytes& raw) {
           raw[24] = 0;
           raw.resize(32);
         });
       }},
      {"map of five channels", "H3", [] { return with_byte("HEAD", 32 + 24, 5); }},
      {"map of no channels", "H3", [] { return with_byte("HEAD", 32 + 24, 0); }},
      {"channel sum", "H4", [] { return with_byte("HEAD", 25, 4); }},
      {"wrap", "H5", [] { return with_byte("HEAD", 26, 2); }},
      {"unbounded", "H5", [] { return with_byte("HEAD", 28, 2); }},
      {"quantity", "H5", [] { return with_byte("HEAD", 29, 5); }},
      {"transform", "H5", [] { return with_byte("HEAD", 30, 3); }},
      {"HEAD reserved", "H5", [] { return with_byte("HEAD", 31, 1); }},
      {"sample type", "H5", [] { return with_byte("HEAD", 32 + 25, 3); }},
      {"colour space", "H5", [] { return with_byte("HEAD", 32 + 26, 7); }},
      {"alpha", "H5", [] { return with_byte("HEAD", 32 + 27, 3); }},
      {"map reserved", "H5", [] { return with_field("HEAD", 32 + 28, 1); }},
      {"empty name", "H6", [] { return with_byte("HEAD", 32, 0); }},
      {"bad name", "H6", [] { return with_byte("HEAD", 32, ' '); }},
      {"name not ended by zeros", "H6", [] { return with_byte("HEAD", 32 + 23, 'x'); }},
      {"equal names", "H6",
       [] {
         return with_chunk("HEAD", [](Bytes& raw) {
           raw[24] = 2;
           const Bytes map(raw.begin() + 32, raw.end());
           raw.insert(raw.end(), map.begin(), map.end());
         });
       }},
      {"alpha of one channel", "H7",
       [] {
         return with_chunk("HEAD", [](Bytes& raw) {
           raw[25] = 1;
           raw[32 + 24] = 1;
           raw[32 + 27] = 1;
         });
       }},
      {"META without line feed", "M1", [] { return with_chunk("META", [](Bytes& raw) { raw.pop_back(); }); }},
      {"META key", "M1", [] { return with_byte("META", 0, ' '); }},
      {"META order", "M1", [] { return with_byte("META", 0, 'c'); }},
      {"META repeated", "M1", [] { return with_byte("META", 0, 'b'); }},
      {"META control character", "M1", [] { return with_byte("META", 2, 9); }},
      {"META no UTF-8", "M1", [] { return with_byte("META", 2, 0xff); }},
      {"QUAL cut short", "QU1",
       [] {
         return with_chunk(
             "QUAL", [](Bytes& raw) { raw.resize(raw.size() - 40 + 4); }, measured_file());
       }},
      {"QUAL without points", "QU1",
       [] {
         return with_chunk(
             "QUAL",
             [](Bytes& raw) {
               raw.resize(16);
               store_u32(&raw[0], 0);
             },
             measured_file());
       }},
      {"QUAL with a point too many", "QU1", [] { return with_field("QUAL", 0, 3, measured_file()); }},
      {"QUAL measures", "QU1", [] { return with_field("QUAL", 4, 32 + 12, measured_file()); }},
      {"QUAL more pairs than the file", "QU1", [] { return with_field("QUAL", 8, 2, measured_file()); }},
      {"QUAL reserved", "QU1", [] { return with_field("QUAL", 12, 1, measured_file()); }},
      {"QUAL levels", "QU2", [] { return with_field("QUAL", 16, 257, measured_file()); }},
      {"QUAL gates", "QU2", [] { return with_field("QUAL", 20, 33, measured_file()); }},
      {"QUAL culling", "QU2", [] { return with_field("QUAL", 24, 0x40000000, measured_file()); }},
      {"QUAL PSNR", "QU2",
       [] {
         return with_chunk(
             "QUAL",
             [](Bytes& raw) {
               store_u32(&raw[4], 13);
               store_u32(&raw[28], 0x43490000);  // 201
             },
             measured_file());
       }},
      {"QUAL measure that it has not", "QU2",
       [] { return with_field("QUAL", 32, 0x3f800000, measured_file()); }},
      {"QUAL NaN", "QU2", [] { return with_field("QUAL", 36, 0x7fc00000, measured_file()); }},
      {"QUAL point reserved", "QU2", [] { return with_field("QUAL", 52, 1, measured_file()); }},
      {"QUAL equal knobs", "QU2", [] { return with_field("QUAL", 56, 0, measured_file()); }},
      {"QUAL safe to copy", "D12",
       [] {
         return with_parts([](Parts& p) { p.entries[find(p, "QUAL")].key.flags = kSafeToCopy; },
                           measured_file());
       }},
      {"stored_blocks too many", "PA9", [] { return with_field("PARM", 28, 9); }},
      {"TRIM bits", "PA9",
       [trimmed] {
         return with_chunk(
             "TRIM", [](Bytes& raw) { raw[0] = static_cast<std::uint8_t>(raw[0] & (raw[0] - 1)); },
             trimmed());
       }},
      {"TRIM padding", "PA9",
       [trimmed] {
         return with_chunk(
             "TRIM", [](Bytes& raw) { raw[3] |= 0x80; }, trimmed());
       }},
      {"code outside the sample", "PA9",
       [trimmed] {
         return with_chunk(
             "SMPL", [](Bytes& raw) { raw.back() = 1; }, trimmed());
       }},
      {"DOMN too short", "DM1", [] { return with_domain([](Bytes& raw) { raw.resize(67); }); }},
      {"DOMN entries missing", "DM1", [] { return with_domain([](Bytes& raw) { raw.resize(76); }); }},
      {"DOMN 65537 views", "DM1", [] { return with_domain([](Bytes& raw) { store_u32(&raw[28], 65537); }); }},
      {"DOMN kind", "DM2", [] { return with_domain([](Bytes& raw) { raw[0] = 4; }); }},
      {"DOMN pairs of views alone", "DM2", [] { return with_domain([](Bytes& raw) { raw[0] = 3; }); }},
      {"DOMN list without entries", "DM2",
       [] {
         return with_domain([](Bytes& raw) {
           raw.resize(68);
           store_u32(&raw[32], 0);
         });
       }},
      {"DOMN range of another kind", "DM2", [] { return with_domain([](Bytes& raw) { raw[0] = 0; }); }},
      {"DOMN scale", "DM2", [] { return with_domain([](Bytes& raw) { raw[2] = 17; }); }},
      {"DOMN reserved", "DM2", [] { return with_domain([](Bytes& raw) { raw[3] = 1; }); }},
      {"DOMN tolerance not a number", "DM3",
       [] { return with_domain([](Bytes& raw) { store_u32(&raw[4], 0x7fc00000); }); }},
      {"DOMN footprints in reverse", "DM3",
       [] { return with_domain([](Bytes& raw) { store_float(raw, 24, -1); }); }},
      {"DOMN theta in reverse", "DM3",
       [] { return with_domain([](Bytes& raw) { store_float(raw, 40, 0.125f); }); }},
      {"DOMN point below the horizon", "DM4",
       [] { return with_domain([](Bytes& raw) { store_u32(&raw[80], 0x80000000); }); }},
      {"DOMN beyond 2^32", "DM5",
       [] { return with_domain([](Bytes& raw) { store_u32(&raw[12], 0xffffffff); }); }},
      {"PARM size", "PA1", [] { return with_chunk("PARM", [](Bytes& raw) { raw.pop_back(); }); }},
      {"sample of one texel", "PA1", [] { return with_field("PARM", 0, 1); }},
      {"sample too wide", "PA1", [] { return with_field("PARM", 0, 65537); }},
      {"patch larger than the sample", "PA1", [] { return with_field("PARM", 16, 11); }},
      {"patch of one texel", "PA1", [] { return with_field("PARM", 16, 1); }},
      {"no patches", "PA1", [] { return with_field("PARM", 8, 0); }},
      {"2^32-1 patches", "PA1", [] { return with_field("PARM", 12, 0xffffffff); }},
      {"overlap above half", "PA1", [] { return with_field("PARM", 20, 5); }},
      {"overlap 0 with many patches", "PA1", [] { return with_field("PARM", 20, 0); }},
      {"overlap 2^32-1", "PA1", [] { return with_field("PARM", 20, 0xffffffff); }},
      {"blend", "PA1", [] { return with_byte("PARM", 24, 2); }},
      {"cut layout", "PA1", [] { return with_byte("PARM", 25, 3); }},
      {"PARM reserved", "PA1", [] { return with_byte("PARM", 27, 1); }},
      {"quilting without cuts", "PA2", [] { return with_byte("PARM", 25, 0); }},
      {"liang with cuts", "PA2", [liang] { return with_byte("PARM", 25, 1, liang()); }},
      {"texture too wide", "PA3", [] { return with_field("HEAD", 4, 24 - 6 + 1); }},
      {"patch column outside", "PA3", [] { return with_field("HEAD", 4, 10); }},
      {"patch row outside", "PA3", [] { return with_field("HEAD", 8, 10); }},
      {"two views", "PA4", [] { return with_field("HEAD", 12, 2); }},
      {"wrapping one way", "PA4", [] { return with_byte("HEAD", 27, 1); }},
      {"unbounded texture", "PA4", [] { return with_byte("HEAD", 28, 1); }},
      {"chunk above 2^27", "PA5",
       [] {
         return with_chunk("PARM", [](Bytes& raw) {
           store_u32(&raw[0], 65536);
           store_u32(&raw[4], 65536);
         });
       }},
      {"coordinate outside", "PA6", [] { return with_byte("COOR", 0, 5); }},
      {"coordinate padding", "PA6", [] { return with_chunk("COOR", [](Bytes& raw) { raw.back() = 1; }); }},
      {"cut entry", "PA7", [] { return with_byte("CUTV", 0, 0xff); }},
      {"cut padding", "PA7", [rgba8] { return with_byte("CUTH", 7, 1, rgba8()); }},
      {"not finite", "PA8",
       [] {
         return with_chunk(
             "SMPL",
             [](Bytes& raw) {
               raw[1] = 0x7c;
               raw[0] = 0;
             },
             sound_file({{"wb", "8"}, {"k", "2"}}, SampleType::float16));
       }},
      {"not a number", "PA8",
       [] {
         return with_chunk(
             "SMPL", [](Bytes& raw) { raw[1] = 0xfe; },
             sound_file({{"wb", "8"}, {"k", "2"}}, SampleType::float16));
       }},
  };
  return all;
}

TEST(Rules, SoundFileIsValid) {
  const Result<Done> verified = verify_bytes(sound_file());
  EXPECT_TRUE(verified) << (verified ? "" : verified.error().message);
  EXPECT_EQ(put_together(take_apart(sound_file())), sound_file());
}

TEST(Rules, DomainIsReadAsItWasWritten) {
  const Bytes file = with_domain([](Bytes&) {});
  const Result<Done> verified = verify_bytes(file);
  EXPECT_TRUE(verified) << (verified ? "" : verified.error().message);
  EXPECT_EQ(decode(file)[0].codes, decode(sound_file())[0].codes);
}

TEST(Rules, EachIsNamedWhenItIsBroken) {
  for (const Case& one : cases()) {
    const Result<Done> verified = verify_bytes(one.file());
    ASSERT_FALSE(verified) << one.name;
    EXPECT_STREQ(verified.error().rule, one.rule) << one.name << ": " << verified.error().message;
    EXPECT_EQ(verified.error().status, one.status) << one.name;
    EXPECT_GE(verified.error().message.size(), 10u) << one.name;
  }
}

TEST(Rules, CompatibleFeaturesAreIgnored) {
  const Bytes file = with_bytes([](Bytes& f) { f[23] = 0x80; });
  EXPECT_TRUE(verify_bytes(file));
}

TEST(Rules, UnknownCriticalChunkIsNamed) {
  for (const Case& one : cases()) {
    if (std::string(one.rule) != "D11") continue;
    EXPECT_NE(verify_bytes(one.file()).error().message.find("'ABCD'"), std::string::npos);
  }
}

TEST(Rules, UnknownAncillaryChunkIsIgnored) {
  const Bytes file = with_parts([](Parts& p) {
    p.entries.insert(p.entries.end() - 1, {{four_cc("ABCD"), 0}, Codec::raw, 0, 0, 0, 0});
    p.stored.insert(p.stored.end() - 1, Bytes(5));
  });
  EXPECT_TRUE(verify_bytes(file));
  EXPECT_EQ(decode(file)[0].codes, decode(sound_file())[0].codes);
}

std::set<std::string> rules_in(const std::filesystem::path& path) {
  std::ifstream in(path);
  const std::string text((std::istreambuf_iterator<char>(in)), {});
  std::set<std::string> found;
  const std::regex rule("\\*\\*\\[([A-Z]+[0-9]+)\\]\\*\\*");
  for (std::sregex_iterator i(text.begin(), text.end(), rule), end; i != end; ++i) found.insert((*i)[1]);
  return found;
}

// The spec's rules are exactly those that have a case here, so no rule is without a file that breaks it.
TEST(Rules, SpecAndCasesListTheSameRules) {
  std::set<std::string> spec = rules_in(std::filesystem::path(BTFC_SPEC) / "btfc.md");
  spec.merge(rules_in(std::filesystem::path(BTFC_SPEC) / "models" / "patch.md"));
  std::set<std::string> tested;
  for (const Case& one : cases()) tested.insert(one.rule);
  EXPECT_EQ(spec, tested);
}

// spec/conformance.md lists every case with its rule.
TEST(Rules, ConformancePageListsTheCases) {
  std::ifstream in(std::filesystem::path(BTFC_SPEC) / "conformance.md");
  const std::string page((std::istreambuf_iterator<char>(in)), {});
  for (const Case& one : cases()) {
    const std::string row = std::string("| ") + one.rule + " | " + one.name + " |";
    EXPECT_NE(page.find(row), std::string::npos) << "missing: " << row;
  }
}

}  // namespace
}  // namespace btfc::test
