using System;

namespace UnityEngine.TestTools
{
    // Marks a test that yields once per frame; tests/unity_client/components/PlayMode.cs runs them.
    public sealed class UnityTestAttribute : Attribute { }
}
