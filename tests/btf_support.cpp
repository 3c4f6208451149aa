// BTFs by formula.
#include "tests/btf_support.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <set>

namespace btfc::test {

std::vector<Direction> rings(int count) {
  std::vector<Direction> directions = {direction_from_degrees(0, 0)};
  for (int ring = 1; ring <= count; ++ring) {
    for (int i = 0; i < 6 * ring; ++i)
      directions.push_back(direction_from_degrees(15.0 * ring, 60.0 * i / ring));
  }
  return directions;
}

DatasetInfo btf_info(std::uint32_t width, std::uint32_t height, std::uint32_t channels, SampleType type,
                     std::vector<Direction> views, std::vector<Direction> lights) {
  DatasetInfo info;
  info.width = width;
  info.height = height;
  for (std::uint32_t c = 0; c < channels; ++c) info.channels.push_back(fmt::format("c{}", c));
  info.type = type;
  info.views = std::move(views);
  info.lights = std::move(lights);
  make_full_product(info);
  return info;
}

Dataset make_btf(DatasetInfo info, const Value& value) {
  Result<Dataset> created = Dataset::create(std::move(info), "");
  EXPECT_TRUE(created) << created.error().message;
  const DatasetInfo& made = created->info();
  std::vector<std::uint16_t> codes(made.image_samples());
  for (std::size_t p = 0; p < made.pairs.size(); ++p) {
    std::size_t at = 0;
    for (std::uint32_t y = 0; y < made.height; ++y) {
      for (std::uint32_t x = 0; x < made.width; ++x) {
        for (std::uint32_t c = 0; c < made.channel_count(); ++c) {
          const double v = value(made.views[made.pairs[p].view], made.lights[made.pairs[p].light], x, y, c);
          const double top = made.type == SampleType::unorm8 ? 255 : 65535;
          codes[at++] = made.type == SampleType::float16
                            ? *finite_half(static_cast<float>(v))
                            : static_cast<std::uint16_t>(std::lround(std::clamp(v, 0.0, 1.0) * top));
        }
      }
    }
    created->write_image(p, codes);
  }
  return std::move(*created);
}

double bumpy(const Direction& view, const Direction& light, std::uint32_t x, std::uint32_t y,
             std::uint32_t channel) {
  const Vector3 v = unit_vector(view), l = unit_vector(light);
  const double sx = 0.5 * std::sin(1.3 * x + 0.4 * y), sy = 0.4 * std::cos(0.7 * x - 1.1 * y);
  const double length = std::sqrt(1 + sx * sx + sy * sy);
  const double nl = std::max(0.0, (l[0] * sx + l[1] * sy + l[2]) / length);
  const Vector3 h = {v[0] + l[0], v[1] + l[1], v[2] + l[2]};
  const double hl = std::sqrt(h[0] * h[0] + h[1] * h[1] + h[2] * h[2]);
  const double nh = std::max(0.0, (h[0] * sx + h[1] * sy + h[2]) / (length * hl));
  return (0.3 + 0.1 * channel + 0.05 * ((x * 7 + y * 3) % 5)) * nl + 0.3 * std::pow(nh, 20);
}

FitResult fit(const char* model, const Dataset& dataset, const OptionValues& options, unsigned threads) {
  FitSettings settings;
  settings.options = options;
  settings.threads = threads;
  FitInput input;
  input.dataset = &dataset;
  Result<FitResult> result = fitter(find_model(model)->id).fit(input, settings);
  if (!result) {
    ADD_FAILURE() << result.error().message;
    return {};
  }
  return *std::move(result);
}

Bytes encode(const char* model, const Dataset& dataset, const OptionValues& options, Codec codec,
             unsigned threads) {
  return pack(fit(model, dataset, options, threads), codec);
}

double rmse(const Dataset& dataset, const Bytes& file, const btfc_selection* selection) {
  btfc_reader* reader = nullptr;
  btfc_texture* loaded = nullptr;
  btfc_error error{};
  EXPECT_EQ(btfc_reader_open_memory(file.data(), file.size(), nullptr, &reader, &error), BTFC_OK)
      << error.message;
  const std::unique_ptr<btfc_reader, ReaderFree> owned(reader);
  EXPECT_EQ(btfc_texture_load(reader, selection, &loaded, &error), BTFC_OK) << error.message;
  const TexturePtr texture(loaded);
  const DatasetInfo& info = dataset.info();
  EXPECT_EQ(btfc_texture_pairs(texture.get()), info.pairs.size());
  double sum = 0;
  std::vector<float> values;
  for (std::uint32_t p = 0; p < info.pairs.size(); ++p) {
    std::uint32_t view = 0, light = 0;
    btfc_texture_pair(texture.get(), p, &view, &light);
    btfc_directions d{};
    btfc_texture_view(texture.get(), view, d.view);
    btfc_texture_light(texture.get(), light, d.light);
    std::uint32_t first = 0;
    for (std::uint32_t m = 0; m < btfc_texture_maps(texture.get()); ++m) {
      btfc_map_info map{};
      btfc_texture_map_info(texture.get(), m, &map);
      values.assign(std::size_t{info.width} * info.height * map.channels, 0);
      EXPECT_EQ(btfc_decode_rect(texture.get(), nullptr, m, &d, 0, 0, info.width, info.height, BTFC_FLOAT32,
                                 values.data(), info.width * map.channels * 4, values.size() * 4),
                BTFC_OK);
      for (std::size_t i = 0; i < values.size(); ++i) {
        const auto texel = static_cast<std::uint32_t>(i / map.channels),
                   c = static_cast<std::uint32_t>(i % map.channels);
        const std::uint16_t code = dataset.code(p, texel % info.width, texel / info.width, first + c);
        EXPECT_TRUE(std::isfinite(values[i]));
        const double off = static_cast<double>(values[i]) - static_cast<double>(code_value(info.type, code));
        sum += off * off;
      }
      first += map.channels;
    }
  }
  return std::sqrt(sum /
                   (static_cast<double>(info.image_samples()) * static_cast<double>(info.pairs.size())));
}

RandomBtf random_btf(ModelId model, std::mt19937& random) {
  const auto below = [&](std::uint32_t n) { return static_cast<std::uint32_t>(random() % n); };
  RandomBtf btf;
  Head& head = btf.head;
  head.model = model;
  head.width = 1 + below(12);
  head.height = 1 + below(12);
  head.wrap_u = head.wrap_v = static_cast<Wrap>(below(2));
  const std::uint32_t maps = 1 + below(3);
  for (std::uint32_t m = 0; m < maps; ++m) {
    Map map;
    map.name = fmt::format("m{}", m);
    map.channels = 1 + below(4);
    map.type = static_cast<SampleType>(below(3));
    head.maps.push_back(map);
  }
  head.views = 1 + below(6);
  head.lights = 1 + below(6);
  const auto points = [&](std::uint32_t count) {
    std::set<DirectionPoint> set;
    while (set.size() < count) {
      const Direction d = direction_from_degrees(below(91), below(360));
      set.insert(point_of(d.theta, d.phi));
    }
    return std::vector<DirectionPoint>(set.begin(), set.end());
  };
  btf.directions.views = points(head.views);
  btf.directions.lights = points(head.lights);
  const bool list = below(2) == 1;
  for (const ViewLight& pair : all_pairs(head.views, head.lights)) {
    const bool needed = pair.light == pair.view % head.lights || pair.view == pair.light % head.views;
    if (!list || needed || below(2) == 0) btf.directions.pairs.push_back(pair);
  }
  head.pairs = static_cast<std::uint32_t>(btf.directions.pairs.size());
  return btf;
}

CodedRows random_rows(std::mt19937& random, std::uint64_t rows, std::uint64_t columns, Precision precision) {
  std::vector<float> values(rows * columns);
  for (float& v : values) v = static_cast<float>(random() % 4001) / 1000.0f - 2.0f;
  return code_rows(values, rows, columns, precision);
}

void check_sizes(const Head& head, const std::vector<RawChunk>& chunks, std::uint64_t formula_bits,
                 std::uint64_t memory_bits) {
  PackOptions options;
  options.codec = Codec::raw;
  const Result<Bytes> file = pack_file(chunks, options);
  ASSERT_TRUE(file) << file.error().message;
  ASSERT_TRUE(verify_bytes(*file)) << verify_bytes(*file).error().message;
  const Result<OpenedFile> opened = open_bytes(*file);
  ASSERT_TRUE(opened);
  EXPECT_EQ(opened->head, head);
  EXPECT_EQ(opened->layout.formula_bits, formula_bits);
  EXPECT_EQ(8 * opened->directory.header.payload_bytes, formula_bits);
  EXPECT_EQ(opened->layout.memory_bits, memory_bits);
  const ByteView view(*file);
  const Result<std::vector<RawChunk>> after = read_all_chunks(source_of(view), opened->directory);
  ASSERT_TRUE(after);
  for (const RawChunk& chunk : chunks) {
    const auto same = std::count_if(after->begin(), after->end(), [&](const RawChunk& other) {
      return other.key.order() == chunk.key.order() && other.raw == chunk.raw;
    });
    EXPECT_EQ(same, 1) << type_name(chunk.key.type);
  }
  const Result<LoadedItem> item = load_item(source_of(view), *opened);
  ASSERT_TRUE(item);
  std::uint64_t words = 0;
  for (const auto& slot : item->words) words += slot.size();
  EXPECT_EQ(32 * words, memory_bits);
}

void check_fast_rows(const std::vector<RawChunk>& chunks) {
  const Result<Bytes> file = pack_file(chunks);
  ASSERT_TRUE(file);
  const TexturePtr t = load(*file);
  ASSERT_TRUE(t);
  const std::uint32_t width = btfc_texture_width(t.get()), height = btfc_texture_height(t.get());
  std::vector<std::int32_t> at;
  for (std::uint32_t y = 0; y < height; ++y) {
    for (std::uint32_t x = 0; x < width; ++x)
      at.insert(at.end(), {static_cast<std::int32_t>(x), static_cast<std::int32_t>(y)});
  }
  const btfc_directions look{{0.3f, -0.1f, 0.5f}, {-0.2f, 0.6f, 0.4f}, 0, 0};
  for (std::uint32_t m = 0; m < btfc_texture_maps(t.get()); ++m) {
    btfc_map_info info{};
    btfc_texture_map_info(t.get(), m, &info);
    std::vector<float> fast(std::size_t{width} * height * info.channels), plain(fast.size());
    ASSERT_EQ(btfc_decode_rect(t.get(), nullptr, m, &look, 0, 0, width, height, BTFC_FLOAT32, fast.data(),
                               width * info.channels * sizeof(float), fast.size() * sizeof(float)),
              BTFC_OK);
    ASSERT_EQ(btfc_decode_texels(t.get(), nullptr, m, &look, at.data(), at.size() / 2, BTFC_FLOAT32,
                                 plain.data(), plain.size() * sizeof(float)),
              BTFC_OK);
    ASSERT_EQ(std::memcmp(fast.data(), plain.data(), fast.size() * sizeof(float)), 0);
  }
}

std::array<float, 4> value_at(const btfc_texture* texture, std::int32_t x, std::int32_t y,
                              const float (&view)[3], const float (&light)[3]) {
  btfc_query query{};
  query.x = x;
  query.y = y;
  std::copy_n(view, 3, query.view);
  std::copy_n(light, 3, query.light);
  std::array<float, 4> value{};
  EXPECT_EQ(btfc_eval(texture, nullptr, &query, sizeof query, 1, value.data(), 4), BTFC_OK);
  return value;
}

}  // namespace btfc::test
