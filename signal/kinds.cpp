namespace hydrostat::signal { extern const char* const kKinds; const char* const kKinds = "loop one_shot"; }
