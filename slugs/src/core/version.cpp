// See core/version.hpp.

#include "core/version.hpp"

#ifndef SLUGS_VERSION
#error "the build defines SLUGS_VERSION"
#endif

namespace slugs {

const char *const version = SLUGS_VERSION;

} // namespace slugs
