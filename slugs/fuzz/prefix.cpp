// A text that a fuzzer puts before the bytes: the declaration of an integer makes every
// input structuredslugs.

extern const char *const prefix = FUZZ_PREFIX;
