// Exit codes of the programs, and the sentence that an error is told in.
#pragma once
#include <string>

#include "format/result.h"

namespace btfc {

// The same for all verbs.
enum ExitCode {
  kExitOk = 0,
  kExitUsage = 1,
  kExitIo = 2,
  kExitInvalid = 3,
  kExitFailed = 4,
  kExitUnsupported = 5,
  kExitDifferent = 7
};

// Prints "btfc VERB: sentence [rule]" to standard error and returns the exit code that fits.
int fail(const std::string& verb, const Error& error);

}  // namespace btfc
