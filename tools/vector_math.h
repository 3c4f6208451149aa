// Three components added, multiplied and made unit vectors of.
#pragma once
#include <cmath>

#include "encoder/dataset/direction.h"

namespace btfc {

inline double dot(const Vector3& a, const Vector3& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }
inline Vector3 cross(const Vector3& a, const Vector3& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}
inline Vector3 minus(const Vector3& a, const Vector3& b) { return {a[0] - b[0], a[1] - b[1], a[2] - b[2]}; }
// a + s b
inline Vector3 along(const Vector3& a, double s, const Vector3& b) {
  return {a[0] + s * b[0], a[1] + s * b[1], a[2] + s * b[2]};
}
inline double length(const Vector3& v) { return std::hypot(v[0], v[1], v[2]); }
inline Vector3 unit(const Vector3& v) {
  const double l = length(v);
  return {v[0] / l, v[1] / l, v[2] / l};
}

}  // namespace btfc
