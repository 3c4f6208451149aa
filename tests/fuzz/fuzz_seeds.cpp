// btfc_fuzz_seeds VECTORS OUT: inputs to begin with for every fuzz target, one folder each, made of the
// vectors, and of a BTF fitted here whose images are large enough for what is done with whole images:
// btfc_fuzz_seeds tests/vectors /tmp/seeds.
#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <utility>

#include "encoder/model_table.h"
#include "format/domain.h"
#include "format/quality_curve.h"
#include "tests/fuzz/fuzz_input.h"
#include "tests/mutation.h"

namespace btfc::test {
namespace {

namespace fs = std::filesystem;

Bytes read_whole(const fs::path& path) {
  std::ifstream in(path, std::ios::binary);
  return Bytes(std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>());
}

void write_seed(const fs::path& folder, const std::string& name, const Bytes& bytes) {
  fs::create_directories(folder);
  std::ofstream(folder / name, std::ios::binary)
      .write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
}

void append(Bytes& to, ByteView more) { to.insert(to.end(), more.begin(), more.end()); }

void append_u16(Bytes& to, std::size_t value) {
  to.push_back(static_cast<std::uint8_t>(value));
  to.push_back(static_cast<std::uint8_t>(value >> 8));
}

// HEAD, PARM and all other critical chunks in canonical order, as fuzz_params takes them.
Bytes parameters_of(const Seed& seed) {
  Bytes head, parm, contents;
  for (const RawChunk& chunk : seed.chunks) {
    if ((chunk.key.flags & kCritical) == 0) continue;
    append(chunk.key.type == kHead ? head : chunk.key.type == kParm ? parm : contents, chunk.raw);
  }
  Bytes input;
  append_u16(input, head.size());
  append_u16(input, parm.size());
  input.push_back(0);
  append(input, head);
  append(input, parm);
  append(input, contents);
  return input;
}

// Chunks as they lie in the file, and their raw bytes for the other parts of fuzz_chunk.
void write_chunks(const fs::path& folder, const Seed& seed, const Bytes& file) {
  const ByteView view(file);
  const Result<Directory> directory = read_directory(memory_source(&view));
  for (std::size_t i = 0; i < directory->entries.size(); ++i) {
    const IndexEntry& entry = directory->entries[i];
    const std::string name = seed.name + "." + std::to_string(i) + type_name(entry.key.type);
    Bytes stored = {0, static_cast<std::uint8_t>(entry.codec == Codec::raw ? 8 : 1), 0, 0, 0, 0};
    store_u32(&stored[2], static_cast<std::uint32_t>(entry.raw_bytes));
    append(stored, view.subspan(entry.offset, entry.stored_bytes));
    write_seed(folder, name + ".stored", stored);
    Bytes raw = {entry.key.type == kMeta ? std::uint8_t{2} : std::uint8_t{1}, 2, 1, 0, 0, 0};
    append(raw, seed.chunks[i].raw);
    write_seed(folder, name + ".raw", raw);
    raw[0] = 3;
    raw[1] = static_cast<std::uint8_t>(i % 3);
    write_seed(folder, name + ".rows", raw);
  }
}

// The file's chunks, and a domain and a curve that say something in every field.
std::vector<RawChunk> with_ancillaries(const Seed& seed, Random& random) {
  std::vector<RawChunk> chunks = seed.chunks;
  Domain domain;
  domain.views.kind = static_cast<DomainKind>(random.below(4));
  domain.lights.kind =
      domain.views.kind == DomainKind::pairs ? DomainKind::pairs : static_cast<DomainKind>(random.below(3));
  for (DomainSide* side : {&domain.views, &domain.lights}) {
    if (side->kind == DomainKind::range) side->range = {0.1f, 1.2f, 0.5f, 3.0f};
    if (side->kind >= DomainKind::list) side->points = {{0, 0}, {1 << 20, -(1 << 21)}};
  }
  domain.radius = 0.1f;
  domain.scale_log2 = 1;
  domain.footprint_least = 1;
  domain.footprint_most = 8;
  chunks.push_back({{kDomn, 0}, write_domain(domain)});
  QualityCurve curve;
  curve.measures = kAllQualityMeasures;
  for (std::uint32_t i = 0; i < 3; ++i)
    curve.points.push_back({{i, i == 1 ? 1u : 0u, i == 2 ? 0.01f : 0.0f},
                            20.0f + static_cast<float>(i),
                            2,
                            0.5f,
                            0.25f,
                            100 * i + 1,
                            7});
  chunks.push_back({{kQual, 0}, write_quality(curve)});
  return chunks;
}

// 12 x 10 texels of noise under 3 views and 4 lights.
Dataset small_btf(Random& random) {
  DatasetInfo info;
  info.width = 12;
  info.height = 10;
  info.channels = {"R", "G", "B"};
  for (int i = 0; i < 4; ++i) {
    info.lights.push_back(direction_from_degrees(i == 0 ? 0 : 40, 120.0 * i));
    if (i < 3) info.views.push_back(direction_from_degrees(20.0 * i, 90));
  }
  make_full_product(info);
  Dataset dataset = std::move(*Dataset::create(info, ""));
  std::vector<std::uint16_t> codes(info.image_samples());
  for (std::size_t p = 0; p < info.pairs.size(); ++p) {
    for (std::uint16_t& code : codes) code = static_cast<std::uint8_t>(random.next());
    dataset.write_image(p, codes);
  }
  return dataset;
}

// Of each model that keeps texels, and of gm, by precision.
std::vector<Seed> fitted_seeds(Random& random) {
  const Dataset dataset = small_btf(random);
  std::vector<Seed> seeds;
  for (const ModelFormat& model : models()) {
    const Fitter& fit = fitter(model.id);
    if (fit.input == InputKind::images) continue;
    for (const char* precision : {"f32", "f16", "u8"}) {
      const OptionValues all = {{"precision", precision}, {"rank", "2"},       {"clusters", "2"},
                                {"components", "12"},     {"iterations", "3"}, {"range", "0"},
                                {"error", "0.05"}};
      FitSettings settings;
      settings.threads = 1;
      for (const OptionSpec& spec : fit.options) {
        if (const auto found = all.find(spec.name); found != all.end()) settings.options.insert(*found);
      }
      if (model.id == ModelId::gm) settings.options.erase("clusters");
      const Result<FitResult> fitted = fit.fit({{}, &dataset}, settings);
      if (!fitted) {
        std::fprintf(stderr, "no seed of %s in %s: %s\n", model.name, precision,
                     fitted.error().message.c_str());
        continue;
      }
      Seed seed;
      seed.name = std::string("fitted.") + model.name + "." + precision;
      seed.chunks = fitted->chunks;
      seeds.push_back(std::move(seed));
    }
  }
  return seeds;
}

// What `size` is asked for, one line an option.
void write_options(const fs::path& folder) {
  static constexpr const char* kOptions[] = {
      "size=64x32\nviews=7\nlights=5\npairs=20\nchannels=1\nbits=16\n",
      "size=64x32\ndirections=81\nrank=3\nclusters=2\nprecision=f16\ntable-precision=u8\n",
      "size=64\ndirections=9\npolynomial=histogram\nprecision=u8\nclusters=4\n",
      "size=64\ndirections=9\ncomponents=100\nlayout=paper\ngates=4\nonion=printed\n",
      "size=64\ndirections=9\nlevels=2\norder=3\nknots=8\nrange=64x64\nclusters=3\n",
      "sample=64x48\nk=3x2\nwb=16\nwe=4\nblend=liang\nmaps=3x8,1x16\n",
      "sample=64x48\nsize=200x100\npack=rgba8\nchannels=4\nbits=16\nstored-blocks=20\n",
      "sample=64x48\nsize=96x96\ntileable=\nwb=16\n"};
  for (std::size_t model = 0; model < kModelCount; ++model) {
    for (std::size_t i = 0; i < std::size(kOptions); ++i) {
      Bytes input = {4, static_cast<std::uint8_t>(model), 0, 0, 0, 0};
      for (const char* c = kOptions[i]; *c != 0; ++c) input.push_back(static_cast<std::uint8_t>(*c));
      write_seed(folder, std::string(models()[model].name) + "." + std::to_string(i) + ".options", input);
    }
  }
}

void write_files(const fs::path& out, const Seed& seed, const std::string& name, Random& random) {
  // The file packed both ways, with several sets of choices behind it.
  for (const Codec codec : {Codec::raw, Codec::zstd}) {
    PackOptions options;
    options.codec = codec;
    options.align_log2 = codec == Codec::raw ? 4 : 6;
    const Result<Bytes> packed = pack_file(seed.chunks, options);
    if (!packed) continue;
    const std::string packed_name = name + (codec == Codec::raw ? ".raw" : ".zstd");
    for (int n = 0; n < 4; ++n) {
      Bytes choices(fuzz::kChoiceBytes);
      for (std::uint8_t& choice : choices)
        choice = n == 0 ? std::uint8_t{0} : static_cast<std::uint8_t>(random.next());
      Bytes input = *packed;
      append(input, choices);
      for (const char* target : {"decode", "api"})
        write_seed(out / target, packed_name + "." + std::to_string(n), input);
      if (n == 0) {
        for (const char* target : {"open", "differential"}) write_seed(out / target, packed_name, input);
      }
    }
  }
  if (const Result<Bytes> more = pack_file(with_ancillaries(seed, random)); more) {
    Bytes input = *more;
    for (std::size_t i = 0; i < fuzz::kChoiceBytes; ++i)
      input.push_back(static_cast<std::uint8_t>(random.next()));
    for (const char* target : {"open", "decode", "api", "differential"})
      write_seed(out / target, name + ".stated", input);
  }
  write_seed(out / "params", name, parameters_of(seed));
}

int run(const fs::path& vectors, const fs::path& out) {
  std::vector<fs::path> paths;
  for (const auto& entry : fs::recursive_directory_iterator(vectors)) {
    if (entry.path().extension() == ".btfc") paths.push_back(entry.path());
  }
  std::sort(paths.begin(), paths.end());
  Random random(1);
  for (const fs::path& path : paths) {
    const std::string name = path.parent_path().filename().string() + "." + path.stem().string();
    const Result<Seed> seed = make_seed(name, read_whole(path));
    if (!seed) {
      std::fprintf(stderr, "'%s' is left out: %s\n", path.c_str(), seed.error().message.c_str());
      continue;
    }
    write_files(out, *seed, name, random);
    write_chunks(out / "chunk", *seed, seed->file);
    // What fuzz_round_trip makes of any bytes is an input: the samples' own.
    Bytes bytes = {static_cast<std::uint8_t>(random.next())};
    append(
        bytes,
        ByteView(seed->chunks.back().raw).first(std::min<std::size_t>(seed->chunks.back().raw.size(), 256)));
    write_seed(out / "round_trip", name, bytes);
  }
  for (const Seed& seed : fitted_seeds(random)) write_files(out, seed, seed.name, random);
  write_options(out / "chunk");
  return paths.empty() ? 1 : 0;
}

}  // namespace
}  // namespace btfc::test

int main(int argc, char** argv) {
  if (argc == 3) return btfc::test::run(argv[1], argv[2]);
  std::fprintf(stderr, "usage: btfc_fuzz_seeds VECTORS OUT\n");
  return 1;
}
