// What of the library others may link to.
#pragma once

#define SODA_API __attribute__((visibility("default")))
