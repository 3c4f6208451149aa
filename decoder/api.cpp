// The C interface: argument checks, exceptions stopped at the border, and the generic loops over the model
// table.
#include <algorithm>
#include <array>
#include <cstring>
#include <memory>
#include <vector>

#include "decoder/convert.h"
#include "decoder/handles.h"

namespace {

using namespace btfc;

ReadLimits limits_of(const btfc_options* options) {
  ReadLimits limits;
  if (options == nullptr) return limits;
  if (options->max_payload_bytes != 0) limits.max_payload_bytes = options->max_payload_bytes;
  if (options->max_chunks != 0) limits.max_chunks = options->max_chunks;
  return limits;
}

// A caller built against an older header has a shorter one, whose missing fields are 0.
constexpr std::size_t kFirstSelection = offsetof(btfc_selection, gates);

btfc_selection whole(const btfc_selection* selection) {
  btfc_selection all{};
  if (selection != nullptr) std::memcpy(&all, selection, std::min(selection->struct_size, sizeof all));
  return all;
}

bool good(const btfc_options* options) {
  return options == nullptr || options->struct_size >= sizeof(btfc_options);
}

ByteSource byte_source(const btfc_source* source) {
  ByteSource bytes;
  bytes.read = [](void* user, std::uint64_t offset, void* destination, std::size_t size) {
    const auto* s = static_cast<const btfc_source*>(user);
    return s->read(s->user, offset, destination, size) == 0;
  };
  bytes.user = const_cast<btfc_source*>(source);
  bytes.size = source->size;
  return bytes;
}

// The reader's source is set; its file is opened, and the caller gets it.
btfc_result open_reader(std::unique_ptr<btfc_reader> reader, const btfc_options* options,
                        btfc_reader** reader_ret, btfc_error* error) {
  Result<OpenedFile> file = open_file(reader->bytes, limits_of(options));
  if (!file) return report(file.error(), error);
  reader->file = *std::move(file);
  *reader_ret = reader.release();
  return BTFC_OK;
}

btfc_quality_point quality_point_of(const QualityPoint& p) {
  return {p.knobs.levels, p.knobs.gates, p.knobs.culling, p.psnr_db, p.mae_lab,
          p.distance,     p.rate,        p.operations,    p.reads};
}

btfc_sample sample_of(const Map& map) { return static_cast<btfc_sample>(map.type); }

bool good_sample(btfc_sample sample) { return sample >= BTFC_UNORM8 && sample <= BTFC_FLOAT32; }

BtfcQuery query_of(const btfc_directions* directions) {
  BtfcQuery query{};
  if (directions == nullptr) {
    query.view = query.light = vec3(0, 0, 1);
    return query;
  }
  const btfc_directions& d = *directions;
  query.level = d.level;
  query.view = vec3(d.view[0], d.view[1], d.view[2]);
  query.light = vec3(d.light[0], d.light[1], d.light[2]);
  query.footprint = d.footprint;
  return query;
}

// One texel through the reference, in any sample type.
void store_texel(const btfc_texture& texture, std::uint32_t map, const BtfcQuery& query, btfc_sample sample,
                 std::uint8_t* out) {
  const Map& m = texture.item.head.maps[map];
  const vec4 value = texture.model->eval(texture.item, map, query);
  for (std::uint32_t c = 0; c < m.channels; ++c) {
    const float v = value[static_cast<int>(c)];
    std::uint8_t* to = out + c * bytes_of(sample);
    if (texture.model->exact_codes) {
      store_code(sample_of(m), code_of(sample_of(m), v), sample, to);
    } else {
      store_value(v, sample, to);
    }
  }
}

BtfcQuery query_of(const btfc_query& from) {
  BtfcQuery query;
  query.texel = ivec2(from.x, from.y);
  query.level = from.level;
  query.view = vec3(from.view[0], from.view[1], from.view[2]);
  query.light = vec3(from.light[0], from.light[1], from.light[2]);
  query.footprint = from.footprint;
  return query;
}

void eval_one(const btfc_texture& texture, const btfc_query& from, float* out) {
  const vec4 value = texture.model->eval(texture.item, from.map, query_of(from));
  std::memcpy(out, &value, texture.item.head.maps[from.map].channels * sizeof(float));
}

// Enough queries to be sorted before they are answered, and how many are held at once.
constexpr std::size_t kManyQueries = 256, kHeldQueries = std::size_t{1} << 20;

// The queries of each map, which the model answers together.
template <class QueryAt>
void eval_many(const btfc_texture& texture, void* cache, const QueryAt& query_at, std::size_t count,
               float* values, std::size_t stride) {
  std::vector<BtfcQuery> held;
  std::vector<std::size_t> numbers;
  std::vector<float> answers;
  for (std::uint32_t map = 0; map < texture.item.head.maps.size(); ++map) {
    const std::size_t channels = texture.item.head.maps[map].channels;
    const auto answer = [&] {
      if (held.empty()) return;
      answers.resize(held.size() * channels);
      texture.model->eval_queries(texture.item, map, held, cache, answers.data());
      for (std::size_t i = 0; i < numbers.size(); ++i)
        std::memcpy(values + numbers[i] * stride, &answers[i * channels], channels * sizeof(float));
      held.clear();
      numbers.clear();
    };
    for (std::size_t q = 0; q < count; ++q) {
      const btfc_query& from = *query_at(q);
      if (from.map != map) continue;
      held.push_back(query_of(from));
      numbers.push_back(q);
      if (held.size() == kHeldQueries) answer();
    }
    answer();
  }
}

bool inside(const Head& head, std::int32_t x, std::int32_t y, std::uint32_t width, std::uint32_t height) {
  return x >= 0 && y >= 0 && std::uint64_t(x) + width <= head.width &&
         std::uint64_t(y) + height <= head.height;
}

// Whether so many queries are worth a cache of their own, or have one.
bool takes_cache(const btfc_texture& texture, const btfc_scratch* scratch, std::size_t queries) {
  return texture.model->make_cache != nullptr && (scratch != nullptr || queries >= kManyQueries);
}

// The scratch's cache, or one for this call.
std::shared_ptr<void> cache_for(const btfc_texture& texture, const btfc_scratch* scratch) {
  if (scratch != nullptr && scratch->texture == &texture) return scratch->cache;
  return texture.model->make_cache(texture.item);
}

// Rows of computed values as samples.
void store_rows(const std::vector<float>& values, std::size_t row, std::uint32_t rows, btfc_sample sample,
                std::uint8_t* out, std::size_t row_stride) {
  for (std::uint32_t r = 0; r < rows; ++r) {
    const float* from = values.data() + r * row;
    std::uint8_t* to = out + r * row_stride;
    if (sample == BTFC_FLOAT32) {
      std::memcpy(to, from, row * sizeof(float));
      continue;
    }
    for (std::size_t i = 0; i < row; ++i) store_value(from[i], sample, to + i * bytes_of(sample));
  }
}

// A rectangle of computed values, rounded to samples band by band: decode(query, rows, values) fills one
// whose top left texel is query's.
template <class Decode>
void decode_bands(const btfc_texture& texture, std::uint32_t map, BtfcQuery query, std::uint32_t width,
                  std::uint32_t height, btfc_sample sample, std::uint8_t* out, std::size_t row_stride,
                  const Decode& decode) {
  constexpr std::uint32_t kBandTexels = 65536, kLeastBand = 8;
  const std::uint32_t band = std::min(height, std::max(kLeastBand, kBandTexels / width));
  const std::size_t row = std::size_t{width} * texture.item.head.maps[map].channels;
  std::vector<float> values(band * row);
  for (std::uint32_t done = 0; done < height; done += band) {
    const std::uint32_t rows = std::min(band, height - done);
    decode(query, rows, values.data());
    store_rows(values, row, rows, sample, out + done * row_stride, row_stride);
    query.texel.y = static_cast<int>(static_cast<std::uint32_t>(query.texel.y) + rows);
  }
}

// A rectangle inside the texture by the model's fast rows, converted row by row where another type is wanted.
void decode_inside(const btfc_texture& texture, std::uint32_t map, std::uint32_t x, std::uint32_t y,
                   std::uint32_t width, std::uint32_t height, btfc_sample sample, std::uint8_t* out,
                   std::size_t row_stride) {
  const Map& m = texture.item.head.maps[map];
  const btfc_sample stored = sample_of(m);
  if (sample == stored) {
    texture.model->decode_rows(texture.item, texture.tables, map, x, y, width, height, out, row_stride);
    return;
  }
  const std::size_t samples = std::size_t{width} * m.channels;
  constexpr std::uint32_t kBand = 64;  // rows
  const std::size_t row_bytes = samples * bytes_of(stored);
  std::vector<std::uint8_t> band(row_bytes * std::min(kBand, height));
  for (std::uint32_t r = 0; r < height; ++r) {
    if (r % kBand == 0) {
      const std::uint32_t rows = std::min(kBand, height - r);
      texture.model->decode_rows(texture.item, texture.tables, map, x, y + r, width, rows, band.data(),
                                 row_bytes);
    }
    const std::uint8_t* row = band.data() + r % kBand * row_bytes;
    for (std::size_t s = 0; s < samples; ++s) {
      const std::uint32_t code = stored == BTFC_UNORM8 ? row[s] : load_u16(&row[2 * s]);
      store_code(stored, code, sample, out + r * row_stride + s * bytes_of(sample));
    }
  }
}
}  // namespace

const char* btfc_result_name(btfc_result result) {
  switch (result) {
    case BTFC_OK:
      return "ok";
    case BTFC_BAD_ARGUMENT:
      return "bad argument";
    case BTFC_IO:
      return "input/output error";
    case BTFC_INVALID_FILE:
      return "invalid file";
    case BTFC_OUT_OF_MEMORY:
      return "out of memory";
    case BTFC_LIMIT:
      return "limit exceeded";
    case BTFC_UNSUPPORTED:
      return "not supported";
  }
  return "unknown result";
}

const char* btfc_version(void) { return "0.1.0"; }

btfc_result btfc_reader_open(const btfc_source* source, const btfc_options* options, btfc_reader** reader_ret,
                             btfc_error* error) {
  if (reader_ret == nullptr) return bad(error, "reader_ret is NULL");
  *reader_ret = nullptr;
  if (source == nullptr || source->read == nullptr) return bad(error, "source or its read function is NULL");
  if (!good(options)) return bad(error, "options->struct_size is smaller than btfc_options");
  return guarded(error, [&] {
    auto reader = std::make_unique<btfc_reader>();
    reader->source = *source;
    reader->bytes = byte_source(&reader->source);
    return open_reader(std::move(reader), options, reader_ret, error);
  });
}

btfc_result btfc_reader_open_memory(const void* data, size_t data_size, const btfc_options* options,
                                    btfc_reader** reader_ret, btfc_error* error) {
  if (reader_ret == nullptr) return bad(error, "reader_ret is NULL");
  *reader_ret = nullptr;
  if (data == nullptr && data_size != 0) return bad(error, "data is NULL");
  if (!good(options)) return bad(error, "options->struct_size is smaller than btfc_options");
  return guarded(error, [&] {
    auto reader = std::make_unique<btfc_reader>();
    reader->memory = ByteView(static_cast<const std::uint8_t*>(data), data_size);
    reader->bytes = memory_source(&reader->memory);
    return open_reader(std::move(reader), options, reader_ret, error);
  });
}

void btfc_reader_free(btfc_reader* reader) { delete reader; }

btfc_result btfc_reader_info(const btfc_reader* reader, btfc_file_info* info_ret) {
  if (reader == nullptr || info_ret == nullptr) return bad(nullptr, "");
  const Head& head = reader->file.head;
  const Header& header = reader->file.directory.header;
  *info_ret = {};
  info_ret->model = find_model(head.model)->name;
  info_ret->version_major = kVersionMajor;
  info_ret->version_minor = kVersionMinor;
  info_ret->width = head.width;
  info_ret->height = head.height;
  info_ret->channels = head.channels();
  info_ret->maps = static_cast<std::uint32_t>(head.maps.size());
  info_ret->views = head.views;
  info_ret->lights = head.lights;
  info_ret->pairs = head.pairs;
  info_ret->unbounded = head.unbounded ? 1 : 0;
  info_ret->chunks = header.chunk_count;
  info_ret->file_bytes = header.file_bytes;
  info_ret->payload_bits = 8 * header.payload_bytes;
  info_ret->memory_bits = reader->file.layout.memory_bits;
  info_ret->levels = level_count(reader->file.layout);
  const DecoderModel& model = decoder_model(head.model);
  if (model.most_gates != nullptr) info_ret->gates = model.most_gates(head, reader->file.parm);
  info_ret->culls = model.culls ? 1 : 0;
  return BTFC_OK;
}

btfc_result btfc_reader_quality(btfc_reader* reader, btfc_quality_info* info_ret, btfc_quality_point* points,
                                size_t point_count, btfc_error* error) {
  if (reader == nullptr || info_ret == nullptr) return bad(error, "reader or info_ret is NULL");
  *info_ret = {};
  if (points == nullptr && point_count != 0) return bad(error, "points is NULL");
  return guarded(error, [&] {
    const Result<std::optional<QualityCurve>> curve = read_file_quality(reader->bytes, reader->file);
    if (!curve) return report(curve.error(), error);
    if (!*curve) return BTFC_OK;
    const QualityCurve& c = **curve;
    *info_ret = {c.measures, c.pairs, static_cast<std::uint32_t>(c.points.size())};
    for (std::size_t i = 0; i < std::min(point_count, c.points.size()); ++i)
      points[i] = quality_point_of(c.points[i]);
    return BTFC_OK;
  });
}

btfc_result btfc_choose(btfc_reader* reader, const btfc_wanted* wanted, btfc_selection* selection,
                        btfc_quality_point* point_ret, btfc_error* error) {
  if (reader == nullptr || wanted == nullptr || selection == nullptr)
    return bad(error, "reader, wanted or selection is NULL");
  if (wanted->struct_size < sizeof(btfc_wanted))
    return bad(error, "wanted->struct_size is smaller than btfc_wanted");
  if (selection->struct_size < sizeof(btfc_selection))
    return bad(error, "selection->struct_size is smaller than btfc_selection");
  return guarded(error, [&] {
    const Result<std::optional<QualityCurve>> curve = read_file_quality(reader->bytes, reader->file);
    if (!curve) return report(curve.error(), error);
    if (!*curve) return report(bad_argument("the file has no measured curve: no QUAL chunk"), error);
    Wanted w;
    if (wanted->psnr_db > 0) w.psnr_db = wanted->psnr_db;
    if (wanted->distance > 0) w.distance = wanted->distance;
    if (wanted->operations > 0) w.operations = wanted->operations;
    const Result<QualityPoint> point = choose_point(**curve, w);
    if (!point) return report(point.error(), error);
    selection->levels = point->knobs.levels;
    selection->gates = point->knobs.gates;
    selection->culling = point->knobs.culling;
    if (point_ret != nullptr) *point_ret = quality_point_of(*point);
    return BTFC_OK;
  });
}

btfc_result btfc_reader_chunk_info(const btfc_reader* reader, uint32_t index, btfc_chunk_info* info_ret) {
  if (reader == nullptr || info_ret == nullptr || index >= reader->file.directory.entries.size())
    return bad(nullptr, "");
  const IndexEntry& entry = reader->file.directory.entries[index];
  *info_ret = {};
  const std::string type = type_name(entry.key.type);
  std::copy(type.begin(), type.end(), info_ret->type);
  info_ret->flags = entry.key.flags;
  info_ret->codec = static_cast<std::uint16_t>(entry.codec);
  info_ret->level = entry.key.level;
  info_ret->part = entry.key.part;
  info_ret->tile = entry.key.tile;
  info_ret->offset = entry.offset;
  info_ret->stored_bytes = entry.stored_bytes;
  info_ret->raw_bytes = entry.raw_bytes;
  info_ret->raw_hash = entry.raw_hash;
  return BTFC_OK;
}

btfc_result btfc_reader_read_chunk(btfc_reader* reader, uint32_t index, void* raw, size_t raw_size,
                                   btfc_error* error) {
  if (reader == nullptr || raw == nullptr) return bad(error, "reader or raw is NULL");
  const auto& entries = reader->file.directory.entries;
  if (index >= entries.size()) return bad(error, "chunk index out of range");
  if (raw_size != entries[index].raw_bytes) return bad(error, "raw_size is not the chunk's raw_bytes");
  return guarded(error, [&] {
    const Result<Bytes> bytes = btfc::read_chunk(reader->bytes, entries[index]);
    if (!bytes) return report(bytes.error(), error);
    std::memcpy(raw, bytes->data(), raw_size);
    return BTFC_OK;
  });
}

btfc_result btfc_verify(const btfc_source* source, const btfc_options* options, btfc_error* error) {
  if (source == nullptr || source->read == nullptr) return bad(error, "source or its read function is NULL");
  if (!good(options)) return bad(error, "options->struct_size is smaller than btfc_options");
  return guarded(error, [&] {
    const Result<Done> verified = verify_file(byte_source(source), limits_of(options));
    return verified ? BTFC_OK : report(verified.error(), error);
  });
}

btfc_result btfc_texture_load(btfc_reader* reader, const btfc_selection* selection,
                              btfc_texture** texture_ret, btfc_error* error) {
  if (texture_ret == nullptr) return bad(error, "texture_ret is NULL");
  *texture_ret = nullptr;
  if (reader == nullptr) return bad(error, "reader is NULL");
  if (selection != nullptr && selection->struct_size < kFirstSelection)
    return bad(error, "selection->struct_size is smaller than the first btfc_selection");
  const btfc_selection what = whole(selection);
  // The format numbers levels from 0.
  const std::uint32_t levels = what.levels == 0 ? kAllLevels : what.levels - 1;
  return guarded(error, [&] {
    Result<LoadedItem> item = load_item(reader->bytes, reader->file, levels);
    if (!item) return report(item.error(), error);
    const Result<std::optional<Domain>> domain = read_file_domain(reader->bytes, reader->file);
    if (!domain) return report(domain.error(), error);
    const bool selects = what.period != 0 || what.relief != 0 || what.gates != 0 || what.culling != 0;
    const DecoderModel& model = decoder_model(item->head.model);
    if (selects && model.select == nullptr) {
      const bool knobs = what.gates != 0 || what.culling != 0;
      return report(bad_argument(knobs ? "the model has no gates and culls nothing"
                                       : "the texture is not unbounded: it has no period and no relief"),
                    error);
    }
    if (selects) {
      if (const auto ok = model.select(*item, {what.period, what.relief, what.gates, what.culling}); !ok)
        return report(ok.error(), error);
    }
    auto texture = std::make_unique<btfc_texture>();
    texture->item = *std::move(item);
    texture->model = &model;
    if (model.make_tables != nullptr) texture->tables = model.make_tables(texture->item);
    texture->domain_stated = domain->has_value();
    texture->domain = domain->value_or(Domain{});
    if (texture->item.head.pairs > 1) {
      texture->view_hull = convex_hull(texture->item.directions.views);
      texture->light_hull = convex_hull(texture->item.directions.lights);
    }
    *texture_ret = texture.release();
    return BTFC_OK;
  });
}

void btfc_texture_free(btfc_texture* texture) { delete texture; }

uint32_t btfc_texture_width(const btfc_texture* texture) { return texture->item.head.width; }
uint32_t btfc_texture_height(const btfc_texture* texture) { return texture->item.head.height; }
int btfc_texture_unbounded(const btfc_texture* texture) { return texture->item.head.unbounded ? 1 : 0; }
uint32_t btfc_texture_maps(const btfc_texture* texture) {
  return static_cast<uint32_t>(texture->item.head.maps.size());
}

btfc_result btfc_texture_map_info(const btfc_texture* texture, uint32_t map, btfc_map_info* info_ret) {
  if (texture == nullptr || info_ret == nullptr || map >= btfc_texture_maps(texture)) return bad(nullptr, "");
  const Map& m = texture->item.head.maps[map];
  *info_ret = {m.name.c_str(), m.channels, sample_of(m), name_of(m.colour_space), static_cast<int>(m.alpha)};
  return BTFC_OK;
}

uint32_t btfc_texture_views(const btfc_texture* texture) { return texture->item.head.views; }
uint32_t btfc_texture_lights(const btfc_texture* texture) { return texture->item.head.lights; }
uint32_t btfc_texture_pairs(const btfc_texture* texture) { return texture->item.head.pairs; }

btfc_result btfc_texture_view(const btfc_texture* texture, uint32_t view, float direction[3]) {
  if (texture == nullptr || direction == nullptr || view >= btfc_texture_views(texture))
    return bad(nullptr, "");
  write_direction(texture->item.directions.views, view, direction);
  return BTFC_OK;
}

btfc_result btfc_texture_light(const btfc_texture* texture, uint32_t light, float direction[3]) {
  if (texture == nullptr || direction == nullptr || light >= btfc_texture_lights(texture))
    return bad(nullptr, "");
  write_direction(texture->item.directions.lights, light, direction);
  return BTFC_OK;
}

btfc_result btfc_texture_pair(const btfc_texture* texture, uint32_t pair, uint32_t* view_ret,
                              uint32_t* light_ret) {
  if (texture == nullptr || view_ret == nullptr || light_ret == nullptr ||
      pair >= btfc_texture_pairs(texture))
    return bad(nullptr, "");
  const std::vector<ViewLight>& pairs = texture->item.directions.pairs;
  *view_ret = pairs.empty() ? 0 : pairs[pair].view;
  *light_ret = pairs.empty() ? 0 : pairs[pair].light;
  return BTFC_OK;
}

btfc_scratch* btfc_scratch_new(const btfc_texture* texture) {
  if (texture == nullptr) return nullptr;
  std::unique_ptr<btfc_scratch> scratch;
  const btfc_result made = guarded(nullptr, [&] {
    scratch = std::make_unique<btfc_scratch>();
    scratch->texture = texture;
    if (texture->model->make_cache != nullptr) scratch->cache = texture->model->make_cache(texture->item);
    return BTFC_OK;
  });
  return made == BTFC_OK ? scratch.release() : nullptr;
}
void btfc_scratch_free(btfc_scratch* scratch) { delete scratch; }

btfc_result btfc_eval(const btfc_texture* texture, btfc_scratch* scratch, const btfc_query* queries,
                      size_t query_stride, size_t query_count, float* values, size_t value_stride) {
  if (query_count == 0) return BTFC_OK;
  if (texture == nullptr || queries == nullptr || values == nullptr || query_stride < sizeof(btfc_query))
    return bad(nullptr, "");
  const auto query_at = [&](size_t q) {
    return reinterpret_cast<const btfc_query*>(reinterpret_cast<const char*>(queries) + q * query_stride);
  };
  const Head& head = texture->item.head;
  for (size_t q = 0; q < query_count; ++q) {
    const std::uint32_t map = query_at(q)->map;
    if (map >= head.maps.size() || value_stride < head.maps[map].channels) return bad(nullptr, "");
  }
  const bool cached = takes_cache(*texture, scratch, query_count);
  if (cached || (texture->model->eval_queries != nullptr && query_count >= kManyQueries)) {
    return guarded(nullptr, [&] {
      const std::shared_ptr<void> cache = cached ? cache_for(*texture, scratch) : nullptr;
      eval_many(*texture, cache.get(), query_at, query_count, values, value_stride);
      return BTFC_OK;
    });
  }
  for (size_t q = 0; q < query_count; ++q) eval_one(*texture, *query_at(q), values + q * value_stride);
  return BTFC_OK;
}

btfc_result btfc_decode_texels(const btfc_texture* texture, btfc_scratch* scratch, uint32_t map,
                               const btfc_directions* directions, const int32_t* texels, size_t count,
                               btfc_sample sample, void* out, size_t out_size) {
  if (count == 0) return BTFC_OK;
  if (texture == nullptr || texels == nullptr || out == nullptr || map >= btfc_texture_maps(texture) ||
      !good_sample(sample)) {
    return bad(nullptr, "");
  }
  const std::size_t texel_bytes = texture->item.head.maps[map].channels * bytes_of(sample);
  if (out_size / texel_bytes < count) return bad(nullptr, "");
  const Map& m = texture->item.head.maps[map];
  if (texture->model->decode_texels != nullptr && sample == sample_of(m)) {
    texture->model->decode_texels(texture->item, texture->tables, map, texels, count,
                                  static_cast<std::uint8_t*>(out));
    return BTFC_OK;
  }
  BtfcQuery query = query_of(directions);
  if (takes_cache(*texture, scratch, count)) {
    return guarded(nullptr, [&] {
      const std::shared_ptr<void> cache = cache_for(*texture, scratch);
      std::vector<BtfcQuery> queries(std::min(count, kHeldQueries), query);
      std::vector<float> values(queries.size() * m.channels);
      for (size_t done = 0; done < count; done += queries.size()) {
        const size_t now = std::min(queries.size(), count - done);
        for (size_t q = 0; q < now; ++q)
          queries[q].texel = ivec2(texels[2 * (done + q)], texels[2 * (done + q) + 1]);
        texture->model->eval_queries(texture->item, map, {queries.data(), now}, cache.get(), values.data());
        store_rows(values, now * m.channels, 1, sample, static_cast<std::uint8_t*>(out) + done * texel_bytes,
                   0);
      }
      return BTFC_OK;
    });
  }
  for (size_t q = 0; q < count; ++q) {
    query.texel = ivec2(texels[2 * q], texels[2 * q + 1]);
    store_texel(*texture, map, query, sample, static_cast<std::uint8_t*>(out) + q * texel_bytes);
  }
  return BTFC_OK;
}

btfc_result btfc_decode_rect(const btfc_texture* texture, btfc_scratch* scratch, uint32_t map,
                             const btfc_directions* directions, int32_t x, int32_t y, uint32_t width,
                             uint32_t height, btfc_sample sample, void* out, size_t row_stride,
                             size_t out_size) {
  if (width == 0 || height == 0) return BTFC_OK;
  if (texture == nullptr || out == nullptr || map >= btfc_texture_maps(texture) || !good_sample(sample)) {
    return bad(nullptr, "");
  }
  const std::size_t texel_bytes = texture->item.head.maps[map].channels * bytes_of(sample);
  const std::size_t row_bytes = std::size_t{width} * texel_bytes;
  if (row_stride < row_bytes || out_size < row_bytes || (out_size - row_bytes) / row_stride < height - 1) {
    return bad(nullptr, "");
  }
  // Coordinates are 32-bit: the rectangle must not run past their end.
  if (std::int64_t{x} + width - 1 > INT32_MAX || std::int64_t{y} + height - 1 > INT32_MAX)
    return bad(nullptr, "");

  auto* bytes = static_cast<std::uint8_t*>(out);
  const DecoderModel& model = *texture->model;
  return guarded(nullptr, [&] {
    if (model.decode_rows != nullptr && inside(texture->item.head, x, y, width, height)) {
      decode_inside(*texture, map, static_cast<std::uint32_t>(x), static_cast<std::uint32_t>(y), width,
                    height, sample, bytes, row_stride);
      return BTFC_OK;
    }
    BtfcQuery query = query_of(directions);
    query.texel = ivec2(x, y);
    if (model.make_cache != nullptr) {
      const std::shared_ptr<void> cache = cache_for(*texture, scratch);
      decode_bands(*texture, map, query, width, height, sample, bytes, row_stride,
                   [&](const BtfcQuery& from, std::uint32_t rows, float* values) {
                     model.decode_cached(texture->item, map, from, width, rows, cache.get(), values);
                   });
      return BTFC_OK;
    }
    constexpr std::uint64_t kFewTexels = 64;  // not worth the reckoning that all texels share
    if (model.decode_values != nullptr && std::uint64_t{width} * height >= kFewTexels &&
        inside(texture->item.head, x, y, width, height)) {
      const std::vector<float> state = model.begin_values(texture->item, map, query);
      decode_bands(*texture, map, query, width, height, sample, bytes, row_stride,
                   [&](const BtfcQuery& from, std::uint32_t rows, float* values) {
                     model.decode_values(texture->item, map, state, from, width, rows, values);
                   });
      return BTFC_OK;
    }
    for (std::uint32_t r = 0; r < height; ++r) {
      for (std::uint32_t c = 0; c < width; ++c) {
        query.texel = ivec2(static_cast<std::int32_t>(x + std::int64_t{c}),
                            static_cast<std::int32_t>(y + std::int64_t{r}));
        store_texel(*texture, map, query, sample, bytes + r * row_stride + c * texel_bytes);
      }
    }
    return BTFC_OK;
  });
}
