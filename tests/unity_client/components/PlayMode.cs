// Runs the package's own play mode tests, one coroutine step per frame.
using System;
using System.Collections;
using System.Reflection;
using UnityEngine.TestTools;

public static class PlayMode
{
    static void Run(string assembly)
    {
        int passed = 0;
        UnityEngine.ImageConversion.Jpeg = null;
        foreach (Type type in Assembly.LoadFrom(assembly).GetTypes())
        {
            foreach (MethodInfo method in type.GetMethods())
            {
                if (method.GetCustomAttributes(typeof(UnityTestAttribute), false).Length == 0) continue;
                var steps = (IEnumerator)method.Invoke(Activator.CreateInstance(type), null);
                while (steps.MoveNext()) Player.Tick();
                Components.Say("passed " + method.Name);
                passed++;
            }
        }
        Components.Say("play mode tests passed " + passed);
    }
}
