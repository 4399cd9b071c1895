using System.Runtime.CompilerServices;

[assembly: InternalsVisibleTo("HapticVLM.Tests.Editor")]
