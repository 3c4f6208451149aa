// What the sanitizers' run time is told in every program of this folder.

// Beside the C library of Debian 12, GCC's run time takes the 16 bytes before a library's thread-local
// storage for a header where that storage lies at 16 within a page, and looks for pointers where that header
// says, and crashes. Static thread-local storage is looked through all the same.
extern "C" [[gnu::visibility("default")]] const char* __asan_default_options();
extern "C" const char* __asan_default_options() {
  return "intercept_tls_get_addr=0"
         ":malloc_context_size=8";  // a test that allocates much took a sixth less
}

// Image libraries bring a logger and a network library, whose initialisers keep memory for each thread.
extern "C" [[gnu::visibility("default")]] const char* __lsan_default_suppressions();
extern "C" const char* __lsan_default_suppressions() { return "leak:liboflog\nleak:libsrt\n"; }

extern "C" [[gnu::visibility("default")]] const char* __lsan_default_options();
extern "C" const char* __lsan_default_options() { return "print_suppressions=0"; }
