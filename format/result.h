// Values or errors: the project's functions return Result<T> instead of throwing.
#pragma once
#include <cstdint>
#include <string>
#include <utility>
#include <variant>

namespace btfc {

enum class Status {
  ok,
  bad_argument,   // the caller's fault: an option or parameter out of range
  io,             // a file could not be read or written
  invalid_file,   // a rule of the spec is broken, or an input is not what its kind demands
  out_of_memory,  // an allocation failed
  limit,          // valid, but above a limit that the caller set
  unsupported,    // valid as far as known, but needs a newer or fuller reader, or another machine
  failed,         // at run time, for a reason outside of what was asked
};

struct Error {
  Status status = Status::ok;
  std::string message;       // one sentence: what, where, what was expected
  const char* rule = "";     // the spec's rule, "D8", where one is broken
  std::uint64_t offset = 0;  // byte offset in the file, where known
};

template <class T>
class [[nodiscard]] Result {
 public:
  Result(T value) : state_(std::move(value)) {}
  Result(Error error) : state_(std::move(error)) {}
  explicit operator bool() const { return state_.index() == 0; }
  T& operator*() { return std::get<0>(state_); }
  const T& operator*() const { return std::get<0>(state_); }
  T* operator->() { return &std::get<0>(state_); }
  const T* operator->() const { return &std::get<0>(state_); }
  const Error& error() const { return std::get<1>(state_); }

 private:
  std::variant<T, Error> state_;
};

struct Done {};  // Result<Done>: success without a value

inline Error bad_argument(std::string message) { return {Status::bad_argument, std::move(message), "", 0}; }
inline Error bad_data(std::string message) { return {Status::invalid_file, std::move(message), "", 0}; }
inline Error io_error(std::string message) { return {Status::io, std::move(message), "", 0}; }
inline Error invalid(const char* rule, std::uint64_t offset, std::string message) {
  return {Status::invalid_file, std::move(message), rule, offset};
}
inline Error unsupported(const char* rule, std::uint64_t offset, std::string message) {
  return {Status::unsupported, std::move(message), rule, offset};
}

}  // namespace btfc
