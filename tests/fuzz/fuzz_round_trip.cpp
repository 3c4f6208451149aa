// Fuzz target: a tiny image or BTF made of the bytes, fitted with options of theirs, packed, loaded and
// decoded: the payload is what the formula says, both codecs hold the same, and every value is finite.
#include <cmath>
#include <string>
#include <vector>

#include "encoder/model_table.h"
#include "format/container.h"
#include "tests/fuzz/fuzz_reader.h"

namespace {

using namespace btfc;
using namespace btfc::fuzz;

// A sample from the input where there is some left, and then from those before it.
class Samples {
 public:
  Samples(Choices& choices, SampleType type) : choices_(choices), type_(type) {}
  std::uint16_t next() {
    if (choices_.left() > 0) state_ = state_ * 31 + choices_.u8();
    state_ = state_ * 0x9e3779b1u + 1;
    const std::uint32_t bits = state_ >> 12;
    if (type_ == SampleType::unorm8) return static_cast<std::uint8_t>(bits);
    const auto code = static_cast<std::uint16_t>(bits);
    const bool finite = type_ != SampleType::float16 || (code & 0x7c00) != 0x7c00;
    return finite ? code : code & 0x83ff;
  }

 private:
  Choices& choices_;
  SampleType type_;
  std::uint32_t state_ = 1;
};

std::string among(Choices& choices, std::initializer_list<const char*> values) {
  return values.begin()[choices.below(static_cast<std::uint32_t>(values.size()))];
}

// Options by name that any model may have; each takes those it knows.
OptionValues options_of(const Fitter& fitter, Choices& choices) {
  OptionValues all = {{"precision", among(choices, {"f32", "f16", "u8"})},
                      {"table-precision", among(choices, {"f32", "f16", "u8"})},
                      {"rank", std::to_string(choices.below(5))},
                      {"clusters", std::to_string(1 + choices.below(4))},
                      {"components", std::to_string(1 + choices.below(6))},
                      {"gates", among(choices, {"1", "2", "4"})},
                      {"levels", std::to_string(1 + choices.below(2))},
                      {"order", std::to_string(choices.below(6))},
                      {"range", "0"},
                      {"knots", among(choices, {"0", "2", "16"})},
                      {"error", "0.05"},
                      {"bands", among(choices, {"power", "laplacian"})},
                      {"torus", "64"},
                      {"polynomial", among(choices, {"none", "histogram", "least-squares"})},
                      {"iterations", "3"},
                      {"transform", among(choices, {"identity", "log"})},
                      {"mean-brdf", among(choices, {"f32", "u8", "coded"})},
                      {"layout", among(choices, {"compact", "paper"})},
                      {"onion", among(choices, {"signed", "printed"})},
                      {"fit", among(choices, {"em", "refined"})},
                      {"k", among(choices, {"2", "2x3", "1"})},
                      {"blend", among(choices, {"liang", "quilting"})},
                      {"pack", among(choices, {"packed", "rgba8"})},
                      {"tileable", ""},
                      {"trim-sample", ""}};
  const std::uint32_t left_out = choices.u32() | choices.u32();
  OptionValues options;
  std::size_t number = 0;
  for (const OptionSpec& spec : fitter.options) {
    const auto found = all.find(spec.name);
    // What bounds the time is always given.
    const bool bound = std::string(spec.name) == "iterations" || std::string(spec.name) == "error" ||
                       std::string(spec.name) == "components" || std::string(spec.name) == "clusters" ||
                       std::string(spec.name) == "range" || std::string(spec.name) == "torus";
    if (found != all.end() && (bound || (left_out >> (number++ % 32) & 1) != 0)) options.insert(*found);
  }
  if (fitter.id == ModelId::gm) options.erase("clusters");
  return options;
}

Image small_image(Choices& choices, SampleType type) {
  Image image;
  image.width = 8 + choices.below(17);
  image.height = 8 + choices.below(17);
  image.channels = 1 + choices.below(4);
  image.type = type;
  Samples samples(choices, type);
  image.codes.resize(std::size_t{image.width} * image.height * image.channels);
  for (std::uint16_t& code : image.codes) code = samples.next();
  return image;
}

Result<Dataset> small_btf(Choices& choices, SampleType type) {
  DatasetInfo info;
  info.width = 4 + choices.below(9);
  info.height = 4 + choices.below(9);
  const std::uint32_t channels = choices.u8() < 128 ? 3 : 1;
  for (std::uint32_t c = 0; c < channels; ++c) info.channels.push_back(std::string(1, "RGB"[c]));
  info.type = type;
  info.wraps = choices.u8() % 2 == 1;
  for (std::vector<Direction>* list : {&info.views, &info.lights}) {
    const std::uint32_t count = 1 + choices.below(4);
    for (std::uint32_t i = 0; i < count; ++i)
      list->push_back(direction_from_degrees(i == 0 ? 0 : 20.0 * i, choices.below(12) * 30.0));
  }
  make_full_product(info);
  if (info.pairs.size() > 2 && choices.u8() < 64) info.pairs.erase(info.pairs.begin() + 1);
  Result<Dataset> dataset = Dataset::create(info, "");
  if (!dataset) return dataset;
  Samples samples(choices, type);
  std::vector<std::uint16_t> codes(info.image_samples());
  for (std::size_t p = 0; p < info.pairs.size(); ++p) {
    for (std::uint16_t& code : codes) code = samples.next();
    dataset->write_image(p, codes);
  }
  return dataset;
}

void check_file(const FitResult& fitted) {
  Bytes file[2];
  for (const Codec codec : {Codec::raw, Codec::zstd}) {
    PackOptions pack;
    pack.codec = codec;
    pack.zstd_level = 3;
    Result<Bytes> packed = pack_file(fitted.chunks, pack);
    FUZZ_CHECK(packed);
    const ByteView view(*packed);
    FUZZ_CHECK(verify_file(memory_source(&view)));
    const Result<OpenedFile> opened = open_file(memory_source(&view));
    FUZZ_CHECK(opened->layout.formula_bits == 8 * opened->directory.header.payload_bytes);
    const Result<std::vector<RawChunk>> chunks = read_all_chunks(memory_source(&view), opened->directory);
    FUZZ_CHECK(chunks && chunks->size() == fitted.chunks.size());
    file[codec == Codec::zstd] = *std::move(packed);
  }
  FUZZ_CHECK(file[1].size() <= file[0].size());

  const Texture texture = Texture::load(file[1]);
  FUZZ_CHECK(texture);
  const std::uint32_t width = texture.width(), height = texture.height();
  for (std::uint32_t m = 0; m < texture.maps(); ++m) {
    for (std::int32_t i = 0; i < 8; ++i) {
      btfc_query query{};
      query.map = m;
      query.x = i;
      query.y = 3 - i;
      query.view[0] = static_cast<float>(i % 3) * 0.4f;
      query.light[1] = static_cast<float>(i % 5) * 0.3f;
      query.view[2] = query.light[2] = 1;
      float values[4] = {};
      FUZZ_CHECK(btfc_eval(texture.get(), nullptr, &query, sizeof query, 1, values, 4) == BTFC_OK);
      for (const float v : values) FUZZ_CHECK(std::isfinite(v));
    }
    if (btfc_texture_unbounded(texture.get()) != 0) continue;  // rectangles of these are made of large tiles
    std::vector<float> whole(std::size_t{width} * height * texture.map(m).channels, NAN);
    FUZZ_CHECK(texture.decode(m, 0, 0, width, height, BTFC_FLOAT32,
                              std::as_writable_bytes(std::span(whole))) == BTFC_OK);
    for (const float v : whole) FUZZ_CHECK(std::isfinite(v));
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  Choices choices({data, size});
  const ModelFormat& model = models()[choices.below(kModelCount)];
  const Fitter& fit = fitter(model.id);
  const auto type = static_cast<SampleType>(choices.below(3));
  FitSettings settings;
  settings.threads = 1;
  settings.seed = choices.u8();
  settings.options = options_of(fit, choices);
  FitInput input;
  Result<Dataset> dataset = bad_argument("");
  if (fit.input == InputKind::images || (fit.input == InputKind::either && choices.u8() < 64)) {
    input.maps.push_back({"image", small_image(choices, type)});
  } else {
    dataset = small_btf(choices, type);
    if (!dataset) return 0;
    input.dataset = &*dataset;
  }
  const Result<FitResult> fitted = fit.fit(input, settings);
  if (fitted) {
    check_file(*fitted);
  } else {
    FUZZ_CHECK(!fitted.error().message.empty());
  }
  return 0;
}
