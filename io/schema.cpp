namespace hydrostat::io { extern const char* const kSchema; const char* const kSchema = "hydrostat"; }
