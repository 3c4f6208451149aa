// What stands behind the C interface's handles, and its border: errors and exceptions become results.
#pragma once
#include <cassert>
#include <cstring>
#include <memory>
#include <new>
#include <vector>

#include "btfc/btfc.h"
#include "decoder/model_table.h"
#include "format/container.h"
#include "format/domain.h"

struct btfc_reader {
  btfc_source source{};
  btfc::ByteView memory;  // used by btfc_reader_open_memory only
  btfc::ByteSource bytes;
  btfc::OpenedFile file;
};

struct btfc_texture {
  btfc::LoadedItem item;
  const btfc::DecoderModel* model = nullptr;
  std::vector<std::uint64_t> tables;  // of the model's fast paths
  bool domain_stated = false;
  btfc::Domain domain;                                      // as DOMN says, or what holds without it
  std::vector<btfc::DirectionPoint> view_hull, light_hull;  // what the directions span; empty without some
};

struct btfc_scratch {
  const btfc_texture* texture = nullptr;
  std::shared_ptr<void> cache;  // of models that keep one
};

namespace btfc {

inline btfc_result result_of(Status status) {
  switch (status) {
    case Status::ok:
      return BTFC_OK;
    case Status::bad_argument:
      return BTFC_BAD_ARGUMENT;
    case Status::io:
      return BTFC_IO;
    case Status::invalid_file:
      return BTFC_INVALID_FILE;
    case Status::out_of_memory:
    case Status::failed:
      return BTFC_OUT_OF_MEMORY;
    case Status::limit:
      return BTFC_LIMIT;
    case Status::unsupported:
      return BTFC_UNSUPPORTED;
  }
  return BTFC_INVALID_FILE;
}

inline btfc_result report(const Error& from, btfc_error* to) {
  const btfc_result result = result_of(from.status);
  if (to != nullptr) {
    *to = {};
    to->result = result;
    to->offset = from.offset;
    std::strncpy(to->rule, from.rule, sizeof to->rule - 1);
    std::strncpy(to->message, from.message.c_str(), sizeof to->message - 1);
  }
  return result;
}

// Runs body(), which may throw bad_alloc, and turns that into a result.
template <class Body>
btfc_result guarded(btfc_error* error, const Body& body) {
  if (error != nullptr) *error = {};
  try {
    return body();
  } catch (const std::bad_alloc&) {
    if (error != nullptr) {
      error->result = BTFC_OUT_OF_MEMORY;
      std::strncpy(error->message, "not enough memory", sizeof error->message - 1);
    }
    return BTFC_OUT_OF_MEMORY;
  }
}

inline btfc_result bad(btfc_error* error, const char* message) {
  assert(!"btfc: bad argument");
  if (error != nullptr) {
    *error = {};
    error->result = BTFC_BAD_ARGUMENT;
    std::strncpy(error->message, message, sizeof error->message - 1);
  }
  return BTFC_BAD_ARGUMENT;
}

// A direction of a list; of a model without directions the normal.
inline void write_direction(const std::vector<DirectionPoint>& points, std::uint32_t index,
                            float direction[3]) {
  const std::array<double, 3> v = unit_vector(points.empty() ? DirectionPoint{} : points[index]);
  for (std::size_t i = 0; i < 3; ++i) direction[i] = static_cast<float>(v[i]);
}

}  // namespace btfc
