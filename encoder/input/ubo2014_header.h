// What the University of Bonn's BTF files begin with: signature, meta block, directions, image size.
#pragma once
#include <cstdint>
#include <string>
#include <vector>

#include "encoder/dataset/direction.h"
#include "encoder/input/ubo2014_file.h"
#include "format/head.h"

namespace btfc {

// How the images are stored, by the file's signature.
enum class Ubo2014Body {
  dfmf,  // a factorisation per colour channel: the files of UBO2014
  fmf,   // one factorisation of all channels
  pvf,   // a PCA per view
  bdi,   // apparent BRDFs, not compressed
};

struct Ubo2014Header {
  Ubo2014Body body = Ubo2014Body::dfmf;
  bool extended = false;  // "!FMF12FCER": the body begins with a header of its own
  std::vector<std::string> channels;
  bool rgb = false;  // three channels that are no wavelengths
  Quantity quantity = Quantity::unspecified;
  std::vector<Direction> views, lights;
  std::uint32_t width = 0, height = 0;  // texels
  std::vector<std::string> notes;

  std::size_t pairs() const { return views.size() * lights.size(); }
  std::uint64_t texels() const { return std::uint64_t{width} * height; }
};

// Whether a file begins with one of the signatures.
bool has_ubo2014_signature(ByteView bytes);

// Leaves the cursor behind the rotations (a BDI's: behind the image size). Counts lie within the limits of a
// data set, directions are finite, above the surface and not repeated, all views list the same lights. Faults
// are the cursor's.
Ubo2014Header read_ubo2014_header(Ubo2014Cursor& cursor);

// The field of rotations: matrices whose meaning is not documented; noted where there are any.
void read_ubo2014_rotations(Ubo2014Cursor& cursor, Ubo2014Header& header);

}  // namespace btfc
