// What a failed verb says and returns.
#include "tools/exit_code.h"

#include <fmt/format.h>

#include <cstdio>

namespace btfc {

int fail(const std::string& verb, const Error& error) {
  const std::string rule = *error.rule != '\0' ? fmt::format(" [{}]", error.rule) : "";
  fmt::print(stderr, "btfc {}: {}{}\n", verb, error.message, rule);
  switch (error.status) {
    case Status::ok:
      return kExitOk;
    case Status::bad_argument:
      return kExitUsage;
    case Status::io:
      return kExitIo;
    case Status::invalid_file:
      return kExitInvalid;
    case Status::out_of_memory:
    case Status::failed:
      return kExitFailed;
    case Status::limit:
    case Status::unsupported:
      return kExitUnsupported;
  }
  return kExitFailed;
}

}  // namespace btfc
