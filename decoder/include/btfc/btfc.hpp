// btfc.hpp - a thin C++ wrapper of btfc.h: ownership and spans, no behaviour of its own. No exceptions.
#ifndef BTFC_BTFC_HPP
#define BTFC_BTFC_HPP
#include <cstring>
#include <memory>
#include <span>
#include <string>

#include "btfc/btfc.h"

namespace btfc {

struct ReaderFree {
  void operator()(btfc_reader* reader) const { btfc_reader_free(reader); }
};
struct TextureFree {
  void operator()(btfc_texture* texture) const { btfc_texture_free(texture); }
};
struct ScratchFree {
  void operator()(btfc_scratch* scratch) const { btfc_scratch_free(scratch); }
};

// An immutable texture; evaluate it from any number of threads. Empty where loading failed: see error().
class Texture {
 public:
  // From a whole file in memory; the bytes may go away afterwards.
  static Texture load(std::span<const unsigned char> file) { return load(file, nullptr); }

  // The same with the setting of its measured curve that gives what is wanted (btfc_choose).
  static Texture load(std::span<const unsigned char> file, const btfc_wanted& wanted) {
    return load(file, &wanted);
  }

  explicit operator bool() const { return texture_ != nullptr; }
  const btfc_error& error() const { return error_; }
  const btfc_texture* get() const { return texture_.get(); }
  std::uint32_t width() const { return btfc_texture_width(get()); }
  std::uint32_t height() const { return btfc_texture_height(get()); }
  std::uint32_t maps() const { return btfc_texture_maps(get()); }

  btfc_map_info map(std::uint32_t number) const {
    btfc_map_info info{};
    btfc_texture_map_info(get(), number, &info);
    return info;
  }

  // What the file was made for, and BTFC_COVERS_ flags of a query.
  btfc_domain domain() const {
    btfc_domain domain{};
    btfc_texture_domain(get(), &domain);
    return domain;
  }
  std::uint32_t covers(std::span<const float, 3> view, std::span<const float, 3> light,
                       float footprint = 1) const {
    return btfc_covers(get(), view.data(), light.data(), footprint);
  }

  // channels(map) floats of one texel; the rest of the four is 0.
  struct Value {
    float channel[4];
  };
  Value texel(std::int32_t x, std::int32_t y, std::uint32_t map = 0) const {
    btfc_query query{};  // directions of length 0 count as the normal
    query.x = x;
    query.y = y;
    query.map = map;
    Value value{};
    btfc_eval(get(), nullptr, &query, sizeof query, 1, value.channel, 4);
    return value;
  }

  // One rectangle, tightly packed.
  btfc_result decode(std::uint32_t map, std::int32_t x, std::int32_t y, std::uint32_t width,
                     std::uint32_t height, btfc_sample sample, std::span<std::byte> out) const {
    const std::size_t bytes = sample == BTFC_UNORM8 ? 1 : sample == BTFC_FLOAT32 ? 4 : 2;
    return btfc_decode_rect(get(), nullptr, map, nullptr, x, y, width, height, sample, out.data(),
                            width * this->map(map).channels * bytes, out.size());
  }

 private:
  static Texture load(std::span<const unsigned char> file, const btfc_wanted* wanted) {
    Texture t;
    btfc_reader* reader = nullptr;
    if (btfc_reader_open_memory(file.data(), file.size(), nullptr, &reader, &t.error_) != BTFC_OK) return t;
    const std::unique_ptr<btfc_reader, ReaderFree> owned(reader);
    btfc_selection selection{};
    selection.struct_size = sizeof selection;
    if (wanted != nullptr && btfc_choose(reader, wanted, &selection, nullptr, &t.error_) != BTFC_OK) return t;
    btfc_texture* texture = nullptr;
    if (btfc_texture_load(reader, &selection, &texture, &t.error_) == BTFC_OK) t.texture_.reset(texture);
    return t;
  }

  std::unique_ptr<btfc_texture, TextureFree> texture_;
  btfc_error error_{};
};

}  // namespace btfc

#endif
