using System;

namespace UnityEngine.TestTools
{
    // Marks a test that yields once a frame; tests/unity_client/components/PlayMode.cs plays them.
    public sealed class UnityTestAttribute : Attribute { }
}
