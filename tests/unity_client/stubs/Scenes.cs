namespace UnityEngine.SceneManagement
{
    public struct Scene
    {
        public GameObject[] GetRootGameObjects()
        {
            return GameObject.Scene.FindAll(thing => !thing.IsDead && thing.transform.parent == null && thing.hideFlags == HideFlags.None).ToArray();
        }
    }

    public static class SceneManager
    {
        public static Scene GetActiveScene() { return default(Scene); }
    }
}
